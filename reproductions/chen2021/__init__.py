"""Reproduction of Chen 2021: the cases, the two pipelines, and every later method."""
