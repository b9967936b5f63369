"""Ground truth of maps that drift: footprints, best fits, overlap and ambiguity."""
