"""PyBullet robots with lidars that explore a world; clean missions, and noise drawn on them afterwards."""
