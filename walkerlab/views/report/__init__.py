"""The report: HTML pages made from stored results alone, with their sections, tables and templates."""
