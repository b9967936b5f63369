"""Conversion of maps and runs to the formats of other programs."""
