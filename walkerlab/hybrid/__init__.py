"""Walking: motion between events, what the events change, and how a walk ends."""
