"""Files: maps, logs and trajectories, read with limits and written atomically."""
