"""Verification: evidence for and against a transform, and the decision to accept it."""
