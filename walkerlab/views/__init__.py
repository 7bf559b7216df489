"""What people see: figures, reports, the interactive page and the command line; nothing here computes a result."""
