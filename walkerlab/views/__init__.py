"""Views for people: figures, reports, the interactive page and the command line; they compute no results."""
