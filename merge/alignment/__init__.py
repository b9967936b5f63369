"""Alignment: candidate transforms refined on the walls of both maps."""
