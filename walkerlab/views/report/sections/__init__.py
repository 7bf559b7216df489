"""The sections of the report, one per file, each built from the available results."""
