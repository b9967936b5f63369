"""Worlds as plain geometry: solid polygons in metres, families that generate them, and their true raster."""
