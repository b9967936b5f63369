"""Lidar and odometry models, and their noise as pure functions of a clean mission."""
