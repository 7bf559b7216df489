"""The command line: options, printing, exit codes; everything else is imported by the command that needs it."""
