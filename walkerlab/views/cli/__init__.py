"""The command line: options, output and exit codes. Each command imports what it needs when it runs."""
