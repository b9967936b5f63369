"""Verification: evidence for and against a transform, and its acceptance."""
