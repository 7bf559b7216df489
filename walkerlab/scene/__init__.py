"""From a config to the least that can run it, and what was left out and why."""
