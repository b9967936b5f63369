"""Chapter 5 of Chen 2021: the map's picture is corrected before anything is matched. A file for each step."""
