"""Evaluation of merges against the ground truth."""
