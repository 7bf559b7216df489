"""Views of the results: figures, reports, the interactive page and the command line."""
