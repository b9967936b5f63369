"""Rao-Blackwellised particle filter in the manner of gmapping: each particle holds a path and a map of its own."""
