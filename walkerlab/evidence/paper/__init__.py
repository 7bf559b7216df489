"""The paper's numbers, tables and errata, compared with measurements."""
