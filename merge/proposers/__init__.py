"""Proposers: from two prepared maps to candidate transforms."""
