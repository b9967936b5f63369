"""Logs of real robots, and maps of them."""
