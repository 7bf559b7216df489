"""The figures, one file each, drawn from stored results alone; the only place where matplotlib is used."""
