"""Runs on disk: simulate, sense, merge and score one team."""
