"""The paper held against what is measured: its printed numbers, their verdicts, and its errata."""
