"""Maps prepared for matching: surfaces, distance fields, pyramids, images."""
