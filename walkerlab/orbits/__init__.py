"""The step map of either model, its periodic gaits, and how they change."""
