"""Find the floor plan that a robot's map belongs to, and the place on it."""
