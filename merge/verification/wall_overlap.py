"""How the walls of two maps lie on one another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.correspondences import count_wall_overlap
from merge.preparation.prepared_map import PreparedMap

TOLERANCE_SHARES = (0.014, 0.010, 0.007, 0.0035, 0.002)
"""Walls this share of the smaller map's diagonal apart may be one wall: from what bent maps need to what crisp ones
bear."""

TOLERANCE_CELLS = 1.5
"""Never less than this many cells of the coarser map."""


@dataclass(frozen=True)
class WallOverlap:
    """Wall lengths under one transform by one tolerance, the mean of both directions, in cells of the coarser map.

    ``on_walls`` lies within ``tolerance`` of surface of the other map that faces the same way. ``opposed`` lies just in
    front of surface that faces the other way; just behind it, the two may be both sides of a thin wall, which says
    nothing. ``in_free`` lies deeper than the tolerance in the other's free space; ``smaller`` is all
    the surface of the map that has less. ``spread`` (0 to 1/2) is the lesser share of the directions that the walls
    on walls face, by the loosest tolerance: 0 in a bare corridor, whose answer may slide along.
    """

    tolerance: float
    on_walls: float
    opposed: float
    in_free: float
    smaller: float
    spread: float

    @property
    def judged(self) -> float:
        """The length on which the other map has an opinion."""
        return self.on_walls + self.opposed + self.in_free

    @property
    def agreement(self) -> float:
        """The number to rank by, 0 to 1: agreeing share of the judged walls, squared, times the cube root of the
        agreeing share of all: contradiction weighs more than little overlap.
        """
        if self.on_walls == 0.0:
            return 0.0
        return (self.on_walls / self.judged) ** 2 * math.cbrt(min(1.0, self.on_walls / self.smaller))


def tolerance_cells(
    target: PreparedMap, source: PreparedMap, scale: float, share: float = TOLERANCE_SHARES[0]
) -> float:
    """How far apart two walls may lie and still be one, in cells of the target."""
    diagonal = min(target.diagonal, scale * source.diagonal)
    return max(TOLERANCE_CELLS * max(1.0, scale), share * diagonal)


def measure_wall_overlap(
    target: PreparedMap, source: PreparedMap, target_from_source: Similarity2, most_points: int = 2**31
) -> WallOverlap:
    """Lay both surfaces on one another, each on the other, by the loosest tolerance; swapping the maps and inverting
    gives the same.

    ``most_points`` thins long surfaces evenly, for speed. Blank maps give zeros.
    """
    return _compared(target, source, target_from_source, most_points, TOLERANCE_SHARES[:1])[0]


def measure_wall_overlap_by_tolerance(
    target: PreparedMap, source: PreparedMap, target_from_source: Similarity2, most_points: int = 2**31
) -> tuple[WallOverlap, ...]:
    """The same by every tolerance, loosest first."""
    return _compared(target, source, target_from_source, most_points, TOLERANCE_SHARES)


def _compared(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    most_points: int,
    shares: tuple[float, ...],
) -> tuple[WallOverlap, ...]:
    scale = target_from_source.scale
    tolerances = np.array([tolerance_cells(target, source, scale, share) for share in shares])
    there, scatter = _lay(target, source, target_from_source, tolerances, most_points)
    back, scatter_back = _lay(source, target, target_from_source.inverse(), tolerances / scale, most_points)
    coarser = max(1.0, scale)
    spread = _lesser_share(scatter * scale + _turned(scatter_back, target_from_source.yaw))
    smaller = min(scale * len(source.points), float(len(target.points))) / coarser
    lengths = (scale * there + back) / (2.0 * coarser)
    return tuple(
        WallOverlap(tolerance / coarser, on_walls, opposed, in_free, smaller, spread)
        for tolerance, (on_walls, opposed, in_free) in zip(tolerances.tolist(), lengths.tolist(), strict=True)
    )


def _lay(
    below: PreparedMap,
    above: PreparedMap,
    below_from_above: Similarity2,
    tolerances: NDArray[np.float64],
    most_points: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lengths (K, 3) on walls, opposed and in free; and the sum (2, 2) of n n^T in the frame of the map below."""
    kept, weight = thinned(len(above.points), most_points)
    lengths, (xx, xy, yy) = count_wall_overlap(
        below.surface, above.surface, kept, below_from_above.matrix(), tolerances
    )
    return weight * lengths, weight * np.array([[xx, xy], [xy, yy]])


@lru_cache(maxsize=256)
def thinned(length: int, most: int) -> tuple[NDArray[np.intp], float]:
    """At most ``most`` indices spread evenly over ``length``, and how many each stands for."""
    if length <= most:
        return frozen_array(np.arange(length), np.intp), 1.0
    return frozen_array(np.linspace(0, length - 1, most), np.intp), length / most


def _turned(scatter: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    rotation = Similarity2(yaw=yaw).matrix()[:, :2]
    return rotation @ scatter @ rotation.T


def _lesser_share(scatter: NDArray[np.float64]) -> float:
    half_trace = float(scatter[0, 0] + scatter[1, 1]) / 2.0
    apart = math.hypot(float(scatter[0, 0] - scatter[1, 1]) / 2.0, float(scatter[0, 1]))
    return max(half_trace - apart, 0.0) / (2.0 * half_trace) if half_trace > 0.0 else 0.0
