"""The physics engine, the robot bodies and their drives."""
