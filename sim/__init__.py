"""Robots with lidars that drive through a world: missions, stored clean, and the noise added afterwards."""
