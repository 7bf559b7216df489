"""Stages of the core, one module each, with the groups and summaries that they store."""
