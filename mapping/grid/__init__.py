"""Occupancy grids: frames, updates by scans, and resampling."""
