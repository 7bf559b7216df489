"""The stages, one module for each: its question, its answer, and what is stored of it."""
