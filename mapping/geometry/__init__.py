"""Rigid motions and similarities of the plane, one at a time or in arrays, and their least-squares fit."""
