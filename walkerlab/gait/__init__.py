"""From steps to gaits: walks, the step map, its fixed points and multipliers, and how two walks compare."""
