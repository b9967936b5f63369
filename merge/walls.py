"""How the walls of two maps lie on one another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.similarity2 import Similarity2
from merge.chart import Chart
from merge.laying import count_laid

TOLERANCE_SHARE = 0.014
"""Walls this share of the smaller map's diagonal apart may be one wall: one number for bent and for crisp maps."""

TOLERANCE_CELLS = 1.5
"""Never less than this many cells of the coarser map."""


@dataclass(frozen=True)
class Walls:
    """Wall lengths under one transform, the mean of both directions, in cells of the coarser map.

    ``on_walls`` lies within the tolerance of surface of the other map that faces the same way. ``opposed`` lies just in
    front of surface that faces the other way; just behind it, the two may be both sides of a thin wall, which says
    nothing. ``in_free`` lies deeper than the tolerance in the other's free space; ``smaller`` is all
    the surface of the map that has less. ``spread`` (0 to 1/2) is the lesser share of the directions that the walls
    on walls face: 0 in a bare corridor, whose answer may slide along.
    """

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


def tolerance_cells(target: Chart, source: Chart, scale: float) -> float:
    """How far apart two walls may lie and still be one, in cells of the target."""
    diagonal = min(target.diagonal, scale * source.diagonal)
    return max(TOLERANCE_CELLS * max(1.0, scale), TOLERANCE_SHARE * diagonal)


def compare_walls(target: Chart, source: Chart, target_from_source: Similarity2, most_points: int = 2**31) -> Walls:
    """Lay both surfaces on one another, each on the other; swapping the maps and inverting gives the same.

    ``most_points`` thins long surfaces evenly, for speed. Blank maps give zeros.
    """
    scale = target_from_source.scale
    tolerance = tolerance_cells(target, source, scale)
    there = _lay(target, source, target_from_source, tolerance, most_points)
    back = _lay(source, target, target_from_source.inverse(), tolerance / scale, most_points)
    coarser = max(1.0, scale)
    lengths = (scale * there.lengths + back.lengths) / (2.0 * coarser)
    scatter = there.scatter * scale + _turned(back.scatter, target_from_source.yaw)
    return Walls(
        on_walls=float(lengths[0]),
        opposed=float(lengths[1]),
        in_free=float(lengths[2]),
        smaller=min(scale * len(source.points), float(len(target.points))) / coarser,
        spread=_lesser_share(scatter),
    )


@dataclass(frozen=True, eq=False)
class _Laid:
    lengths: NDArray[np.float64]  # on walls, opposed, in free
    scatter: NDArray[np.float64]  # sum of n n^T over the walls on walls, in the frame of the map below


def _lay(below: Chart, above: Chart, below_from_above: Similarity2, tolerance: float, most_points: int) -> _Laid:
    kept, weight = thinned(len(above.points), most_points)
    counts = count_laid(below.surface, above.surface, kept, below_from_above.matrix(), tolerance)
    xx, xy, yy = weight * counts[3:]
    return _Laid(weight * counts[:3], np.array([[xx, xy], [xy, yy]]))


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
