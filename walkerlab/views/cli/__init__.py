"""The command line: options, output and exit codes; each command imports everything else that it needs."""
