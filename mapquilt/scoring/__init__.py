"""The score of a run: its merge against the ground truth."""
