"""The report: HTML pages, made only from stored results, with sections, tables and templates."""
