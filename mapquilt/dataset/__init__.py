"""Data sets: many samples from one specification, made in parallel, resumable, the same bytes every time."""
