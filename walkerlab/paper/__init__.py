"""The study that is redone: its equations as printed, its numbers, its errata, and what is to be said of them."""
