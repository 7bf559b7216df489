"""The walker in other engines: one adapter a file, one registry, one signature."""
