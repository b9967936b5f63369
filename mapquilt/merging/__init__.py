"""Merges on disk: inputs, results and their records."""
