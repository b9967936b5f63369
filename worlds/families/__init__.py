"""Families of generated worlds, one file each, and their registry."""
