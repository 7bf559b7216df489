"""The report: one HTML page made from stored results alone; sections, their tables, and the template."""
