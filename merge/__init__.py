"""Grids in; transforms, verdicts and one grid out. Knows no simulator and no truth."""
