"""Places to explore, as plain geometry: solid polygons in metres, the families that draw them, their true raster."""
