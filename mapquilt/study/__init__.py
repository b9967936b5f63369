"""Studies: one setting, or two, varied on the same missions."""
