"""Front ends: from a robot's log to the poses that it maps with."""
