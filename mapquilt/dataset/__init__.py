"""Data sets: many samples from one specification, made in parallel, resumable and reproducible to the byte."""
