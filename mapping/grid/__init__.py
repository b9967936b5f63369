"""Occupancy grids: where cells lie, how scans fill them, and how they are resampled."""
