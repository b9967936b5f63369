"""Places to explore, as plain geometry."""
