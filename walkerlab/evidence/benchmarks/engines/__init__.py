"""The walker in other engines: one adapter module per engine, all with the same interface."""
