"""Simulated robots with lidars in a world."""
