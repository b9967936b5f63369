"""Records that every step of a merge reads or returns."""
