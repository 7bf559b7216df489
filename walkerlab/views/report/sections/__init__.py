"""The sections of the report, a file for each subject. They are built from the available results."""
