"""Adversities that make SLAM fail: people, doors, objects, glass, ramps, slipping wheels and late scans."""
