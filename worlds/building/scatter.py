"""Scatter objects with a least distance between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from worlds.building.furniture_placement import gap_between
from worlds.polygon import Polygon


def scattered(pieces: Iterable[Polygon], standing: Sequence[Polygon], gap: float) -> list[Polygon]:
    """Return the convex pieces, in order, that keep ``gap`` [m] from ``standing`` pieces and from each other.

    If the gap is at least as wide as a robot, the floor stays connected.
    """
    kept: list[Polygon] = []
    lows, highs = [piece.min(axis=0) for piece in standing], [piece.max(axis=0) for piece in standing]
    for piece in pieces:
        low, high = piece.min(axis=0) - gap, piece.max(axis=0) + gap
        others = [*standing, *kept]
        meets = (np.array(lows).reshape(-1, 2) <= high) & (np.array(highs).reshape(-1, 2) >= low)
        if all(gap_between(piece, others[index]) >= gap for index in np.flatnonzero(meets.all(axis=1))):
            kept.append(piece)
            lows.append(piece.min(axis=0))
            highs.append(piece.max(axis=0))
    return kept


def blob(rng: np.random.Generator, x: float, y: float, radius: float, corners: int = 12) -> Polygon:
    """Draw a convex, irregular round object about (x, y) [m], such as a bush or a rock, no wider than
    ``radius`` [m]."""
    stretch, yaw = rng.uniform(0.65, 1.0), rng.uniform(0.0, np.pi)
    angles = np.sort(2.0 * np.pi * (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) / corners)
    local = radius * np.stack((np.cos(angles), stretch * np.sin(angles)), axis=-1)
    turn = np.array([(np.cos(yaw), np.sin(yaw)), (-np.sin(yaw), np.cos(yaw))])
    piece: Polygon = local @ turn + (x, y)
    return piece
