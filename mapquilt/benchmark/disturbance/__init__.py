"""Pairs of a data set with what real maps have and simulated ones lack: warps, specks, thick walls, gaps, furniture."""
