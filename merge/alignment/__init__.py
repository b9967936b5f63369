"""Alignment: proposals refined on the walls of both maps."""
