"""Benchmarks of cost: time and memory of each step."""
