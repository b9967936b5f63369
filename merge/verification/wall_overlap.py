"""Overlap of the walls of two maps under a transform, and the alignment score."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.preparation.surface import Surface, depth_at, nearest_point, normal_cosine, thinned
from merge.records.bend import Bend
from merge.verification.settings import WallOverlapSettings


@dataclass(frozen=True)
class WallOverlap:
    """Wall lengths under one transform by one tolerance, the mean of both directions, in cells of the coarser map.

    - ``inlier_length``: walls within ``tolerance`` of a wall of the other map with the same orientation;
    - ``opposed_length``: walls just in front of one with the opposite orientation. (Just behind it the two may be both
      sides of a thin wall, and count as nothing.);
    - ``violation_length``: walls deeper than the tolerance in the other map's free space;
    - ``shorter_length``: all walls of the map that has less;
    - ``normal_isotropy``: smaller share, 0 to 1/2, of the two principal directions of the inliers' normals, by the
      loosest tolerance: 0 in a bare corridor, where the answer may slide along the walls.
    """

    tolerance: float
    inlier_length: float
    opposed_length: float
    violation_length: float
    shorter_length: float
    normal_isotropy: float

    @property
    def compared_length(self) -> float:
        """Length of the walls that the other map confirms or contradicts."""
        return self.inlier_length + self.opposed_length + self.violation_length

    @property
    def inlier_ratio(self) -> float | None:
        """``inlier_length`` as a share of ``compared_length``; None if nothing is compared."""
        return self.inlier_length / self.compared_length if self.compared_length > 0.0 else None

    @property
    def violation_ratio(self) -> float | None:
        """``violation_length`` as a share of ``compared_length``; None if nothing is compared."""
        return self.violation_length / self.compared_length if self.compared_length > 0.0 else None

    @property
    def score(self) -> float:
        """Alignment score, 0 to 1: the inlier ratio squared, times the square root of the inliers' share of all walls.

        So contradiction costs more than little overlap.
        """
        if self.inlier_length == 0.0:
            return 0.0
        share = min(1.0, self.inlier_length / self.shorter_length)
        return (self.inlier_length / self.compared_length) ** 2 * math.sqrt(share)


def tolerance_cells(
    target: PreparedMap,
    source: PreparedMap,
    scale: float,
    settings: WallOverlapSettings = WallOverlapSettings(),
    level: int = 0,
) -> float:
    """Return the largest distance of two walls that count as one, in cells of the target; loosest at level 0."""
    diagonal = smaller_diagonal(target, source, scale)
    return max(settings.min_tolerance_cells * max(1.0, scale), settings.tolerance_shares[level] * diagonal)


def measure_wall_overlap(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    max_points: int = 2**31,
    settings: WallOverlapSettings = WallOverlapSettings(),
) -> WallOverlap:
    """Measure by the loosest tolerance how the walls of two maps overlap under a transform, cells to cells.

    Swapping the maps and inverting the transform gives the same. ``max_points`` thins long walls evenly, for speed.
    Blank maps give zeros.
    """
    return _measure(target, source, target_from_source, max_points, settings, levels=1)[0]


def measure_wall_overlap_by_tolerance(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    max_points: int = 2**31,
    settings: WallOverlapSettings = WallOverlapSettings(),
    bend: Bend | None = None,
) -> tuple[WallOverlap, ...]:
    """Measure the same by every tolerance, loosest first; with a ``bend``, after the source was bent."""
    levels = len(settings.tolerance_shares)
    return _measure(target, source, target_from_source, max_points, settings, levels, bend)


def mean_score(overlaps: Sequence[WallOverlap]) -> float:
    """Return the mean of the alignment scores by all tolerances, 0 to 1."""
    return sum(overlap.score for overlap in overlaps) / len(overlaps)


def classify_walls(
    below: Surface,
    above: Surface,
    members: NDArray[np.intp],
    below_from_above: Similarity2,
    tolerance: float,
    min_cosine: float = WallOverlapSettings.min_normal_cosine,
) -> NDArray[np.float64]:
    """Classify wall points of ``above``, by index (N,), under a transform: (N, 3), of which at most one is 1.

    They lie on a wall of ``below`` with the same orientation, just in front of one with the opposite orientation, or
    deeper than ``tolerance`` [cells of ``below``] in its free space.
    """
    return _classify(below, above, members, below_from_above.matrix(), np.array([tolerance]), min_cosine)


def _measure(
    target: PreparedMap,
    source: PreparedMap,
    target_from_source: Similarity2,
    max_points: int,
    settings: WallOverlapSettings,
    levels: int,
    bend: Bend | None = None,
) -> tuple[WallOverlap, ...]:
    scale, cosine = target_from_source.scale, settings.min_normal_cosine
    tolerances = np.array([tolerance_cells(target, source, scale, settings, level) for level in range(levels)])
    bent, seen, back = bent_surfaces(target, source, target_from_source, bend)
    there, scatter = _overlay(target.surface, bent, target_from_source, tolerances, max_points, cosine)
    here, scatter_back = _overlay(source.surface, seen, back, tolerances / scale, max_points, cosine)
    coarser = max(1.0, scale)
    isotropy = _isotropy(scatter * scale + _rotated(scatter_back, target_from_source.yaw))
    shorter = min(scale * len(source.points), float(len(target.points))) / coarser
    lengths = (scale * there + here) / (2.0 * coarser)
    return tuple(
        WallOverlap(tolerance / coarser, inlier, opposed, violation, shorter, isotropy)
        for tolerance, (inlier, opposed, violation) in zip(tolerances.tolist(), lengths.tolist(), strict=True)
    )


def bent_surfaces(
    target: PreparedMap, source: PreparedMap, target_from_source: Similarity2, bend: Bend | None
) -> tuple[Surface, Surface, Similarity2]:
    """Return the source's surface after the bend; the target's, to be compared with the source before the bend; and the
    transform for the latter, source from target.

    Normals do not bend: a strain of some per cent turns them by as little.
    """
    back = target_from_source.inverse()
    if bend is None:
        return source.surface, target.surface, back
    bent = (bend.apply(source.points), *source.surface[1:])
    seen = (bend.remove(back.apply(target.points)), Similarity2(yaw=back.yaw).apply(target.normals))
    return bent, (*seen, *target.surface[2:]), Similarity2()


def _overlay(
    below: Surface,
    above: Surface,
    below_from_above: Similarity2,
    tolerances: NDArray[np.float64],
    max_points: int,
    min_cosine: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return inlier, opposed and violation lengths (K, 3), and the sum (2, 2) of n n^T in the frame of ``below``."""
    kept, weight = thinned(len(above[0]), max_points)
    lengths, (xx, xy, yy) = _count_wall_overlap(below, above, kept, below_from_above.matrix(), tolerances, min_cosine)
    return weight * lengths, weight * np.array([[xx, xy], [xy, yy]])


def _rotated(scatter: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    rotation = Similarity2(yaw=yaw).matrix()[:, :2]
    return rotation @ scatter @ rotation.T


def _isotropy(scatter: NDArray[np.float64]) -> float:
    half_trace = float(scatter[0, 0] + scatter[1, 1]) / 2.0
    radius = math.hypot(float(scatter[0, 0] - scatter[1, 1]) / 2.0, float(scatter[0, 1]))
    return max(half_trace - radius, 0.0) / (2.0 * half_trace) if half_trace > 0.0 else 0.0


@njit(cache=True)
def _count_wall_overlap(
    below: Surface,
    above: Surface,
    kept: NDArray[np.intp],
    matrix: NDArray[np.float64],
    tolerances: NDArray[np.float64],
    min_cosine: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Count the kept points of ``above``, moved by ``matrix`` (2, 3), on ``below``, by tolerance, loosest first.

    Return the numbers (K, 3) of points on walls of the same orientation, just in front of walls of the opposite one,
    and deep in free space; and xx, xy and yy (3,) of the sum of n n^T over those on walls by the first tolerance.
    """
    scale = math.hypot(matrix[0, 0], matrix[1, 0])
    c, s = matrix[0, 0] / scale, matrix[1, 0] / scale
    counts, scatter = np.zeros((len(tolerances), 3)), np.zeros(3)
    for k in kept:
        px, py, ax, ay = above[0][k, 0], above[0][k, 1], above[1][k, 0], above[1][k, 1]
        x = matrix[0, 0] * px + matrix[0, 1] * py + matrix[0, 2]
        y = matrix[1, 0] * px + matrix[1, 1] * py + matrix[1, 2]
        nx, ny = c * ax - s * ay, s * ax + c * ay
        index, away = nearest_point(below, x, y, nx, ny)
        if index >= 0 and normal_cosine(nx, ny, below[1][index, 0], below[1][index, 1]) <= min_cosine:
            away = math.inf
        if away <= tolerances[0]:
            scatter[0] += nx * nx
            scatter[1] += nx * ny
            scatter[2] += ny * ny
        if away <= tolerances[-1]:
            counts[:, 0] += 1.0
            continue
        across, opposed = _nearest_opposed(below, x, y, nx, ny, min_cosine)
        deep = depth_at(below, x, y)
        for level, tolerance in enumerate(tolerances):
            if away <= tolerance:
                counts[level, 0] += 1.0
            elif across <= tolerance:
                counts[level, 1] += opposed
            elif deep > tolerance:
                counts[level, 2] += 1.0
    return counts, scatter


@njit(cache=True)
def _classify(
    below: Surface,
    above: Surface,
    members: NDArray[np.intp],
    matrix: NDArray[np.float64],
    tolerances: NDArray[np.float64],
    min_cosine: float,
) -> NDArray[np.float64]:
    classes = np.zeros((len(members), 3))
    for k in range(len(members)):
        classes[k] = _count_wall_overlap(below, above, members[k : k + 1], matrix, tolerances, min_cosine)[0][0]
    return classes


@njit(cache=True)
def _nearest_opposed(below: Surface, x: float, y: float, nx: float, ny: float, min_cosine: float) -> tuple[float, bool]:
    """Return the distance to the nearest wall of the opposite orientation, and True if (x, y) is in front of it."""
    index, distance = nearest_point(below, x, y, -nx, -ny)
    if index < 0:
        return distance, False
    qx, qy = below[1][index, 0], below[1][index, 1]
    in_front = (x - below[0][index, 0]) * qx + (y - below[0][index, 1]) * qy > 0.0
    return distance, in_front and normal_cosine(nx, ny, qx, qy) < -min_cosine
