"""Stages of the core, one module each, and the groups and summaries that they store."""
