"""The sections of the report, one a file; each is made from the results that there are, or is left out."""
