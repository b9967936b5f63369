"""Rigid motions and similarities of the plane, single and in batches, and their least-squares fit."""
