"""Results as files: what is stored, under which key, by whom and when, and under whose lock."""
