"""Long work: executors, journals, caches and progress."""
