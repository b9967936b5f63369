"""Proposals from the pattern of small isolated objects: trees, pillars, boxes."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal

Marks = NDArray[np.float64]
"""Landmarks (N, 3): x and y of the middle, and size, in cells of a ``PreparedMap``; the largest first."""


@dataclass(frozen=True)
class Landmarks:
    """Match small isolated objects, such as trees, pillars and boxes, by the pattern that they form.

    Where no walls run straight and features are few, this pattern is all that two maps share. Each landmark is paired
    with some neighbours. A pair of either map makes a similarity; it is kept if the sizes fit, and its votes are the
    landmarks of the source that it puts on one of the target.
    Source: geometric hashing over a basis of two points (Lamdan and Wolfson 1988), with every basis tried.

    - ``gap_share`` [of the diagonal]: occupied cells so near one another are one object;
    - ``size_share`` [of the diagonal]: a larger object is no landmark;
    - ``min_cells``: nor is one of fewer cells;
    - ``most``: landmarks of a map, the largest; ``neighbours``: each is paired with so many of the nearest;
    - ``near_share`` [of the smaller map's diagonal]: two landmarks so near one another are one;
    - ``likeness``: factor by which sizes may differ, because an object is often seen from one side only;
    - ``scale_slack``: factor by which two landmarks may miss the bounds of the scale;
    - ``min_inliers``: a similarity with fewer is chance; ``proposals``: number of proposals.
    """

    gap_share: float = 0.006
    size_share: float = 0.09
    most: int = 60
    neighbours: int = 10
    near_share: float = 0.012
    likeness: float = 1.7
    min_cells: int = 4
    scale_slack: float = 1.03
    min_inliers: int = 4
    proposals: int = 12

    def __post_init__(self) -> None:
        require_valid(self)

    def describe(self, prepared: PreparedMap) -> tuple[Marks, float]:
        """Find the landmarks; return them with the diagonal."""
        return _landmarks(prepared.grid, prepared.diagonal, self), prepared.diagonal

    def propose(
        self,
        target: tuple[Marks, float],
        source: tuple[Marks, float],
        scale: ScaleRange,
        rng: np.random.Generator,
    ) -> tuple[Proposal, ...]:
        """Propose similarities that put many landmarks on one another, most inliers first."""
        (there, diagonal), (here, other_diagonal) = target, source
        if min(len(there), len(here)) < self.min_inliers:
            return ()
        near = self.near_share * min(diagonal, scale.middle * other_diagonal)
        bounds = (scale.low / self.scale_slack, scale.high * self.scale_slack)
        bases = _bases(there, self.neighbours, 3.0 * near), _bases(here, self.neighbours, 0.0)
        counts, turns, shifts = _count_inliers(
            there, bases[0], here, bases[1], _lattice(there, near), near, bounds, self.likeness, self.min_inliers
        )
        best = np.argsort(-counts, kind="stable")[: self.proposals]
        found = [self._refit(there, here, complex(turns[k]), complex(shifts[k]), near, scale) for k in best]
        return tuple(sorted((p for p in found if p is not None), key=lambda proposal: -(proposal.inliers or 0)))

    def _refit(
        self, there: Marks, here: Marks, turn: complex, shift: complex, near: float, scale: ScaleRange
    ) -> Proposal | None:
        from scipy.spatial import cKDTree  # here: loading it takes a tenth of a merge, and few pairs come this far

        moved = turn * (here[:, 0] + 1j * here[:, 1]) + shift
        found = cKDTree(there[:, :2]).query(np.stack((moved.real, moved.imag), axis=-1))
        distance, index = np.asarray(found[0], np.float64), np.asarray(found[1], np.intp)
        close = distance < 1.5 * near
        answer = fit_similarity(there[index[close], :2], here[close, :2], scale)
        if answer is None:
            return None
        return Proposal(answer, matches=min(len(there), len(here)), inliers=int(close.sum()))


def _landmarks(grid: OccupancyGrid, diagonal: float, settings: Landmarks) -> Marks:
    reach = max(1, round(settings.gap_share * diagonal))
    disk = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    _, label_of = cv2.connectedComponents(cv2.dilate(grid.occupied.astype(np.uint8), disk), connectivity=8)
    rows, cols = np.nonzero(grid.occupied)
    if not rows.size:
        return np.empty((0, 3))
    label = label_of[rows, cols]
    order = np.argsort(label, kind="stable")
    first = np.flatnonzero(np.diff(label[order], prepend=-1))
    low = [np.minimum.reduceat(cells[order], first) for cells in (cols, rows)]
    high = [np.maximum.reduceat(cells[order], first) for cells in (cols, rows)]
    cells = np.diff(first, append=len(order))
    x, y = ((a + b + 1) / 2.0 for a, b in zip(low, high, strict=True))
    size = np.maximum(*(b - a for a, b in zip(low, high, strict=True))) + 1.0
    kept = np.flatnonzero((cells >= settings.min_cells) & (size <= settings.size_share * diagonal))
    kept = kept[np.argsort(-cells[kept], kind="stable")][: settings.most]
    return np.stack((x[kept], y[kept], size[kept]), axis=-1)


def _bases(marks: Marks, neighbours: int, least: float) -> NDArray[np.intp]:
    """Pair each landmark with its nearest that are at least so far away: indices (P, 2)."""
    apart = np.hypot(*(marks[:, None, :2] - marks[None, :, :2]).transpose(2, 0, 1))
    apart[apart <= least] = np.inf
    nearest = np.argsort(apart, axis=1, kind="stable")[:, :neighbours]
    first = np.repeat(np.arange(len(marks)), nearest.shape[1])
    pairs = np.stack((first, nearest.ravel()), axis=-1)
    return np.asarray(pairs[np.isfinite(apart[pairs[:, 0], pairs[:, 1]])], np.intp)


def _lattice(marks: Marks, near: float) -> tuple[NDArray[np.bool_], float, float]:
    """Rasterise landmarks in squares of side ``near``: return a mask, dilated, and its corner x, y."""
    corner = marks[:, :2].min(axis=0) - 2.0 * near
    cols, rows = np.floor((marks[:, :2] - corner) / near).astype(np.intp).T
    filled = np.zeros((rows.max() + 3, cols.max() + 3), np.uint8)
    filled[rows, cols] = 1
    beside = cv2.dilate(filled, np.ones((3, 3), np.uint8)).astype(np.bool_)
    return beside, float(corner[0]), float(corner[1])


@njit(cache=True)
def _count_inliers(
    there: Marks,
    there_bases: NDArray[np.intp],
    here: Marks,
    here_bases: NDArray[np.intp],
    lattice: tuple[NDArray[np.bool_], float, float],
    near: float,
    bounds: tuple[float, float],
    likeness: float,
    least: int,
) -> tuple[NDArray[np.int64], NDArray[np.complex128], NDArray[np.complex128]]:
    """Count the inliers of the similarity of every two bases, within the bounds of the scale.

    Return numbers of inliers, turns and shifts (target = turn * source + shift) of those with at least ``least``.
    """
    beside, left, low = lattice
    p = there[:, 0] + 1j * there[:, 1]
    q = here[:, 0] + 1j * here[:, 1]
    counts, turns, shifts = [0], [0j], [0j]
    for i, j in there_bases:
        for k, m in here_bases:
            turn = (p[j] - p[i]) / (q[m] - q[k])
            scale = abs(turn)
            if scale < bounds[0] or scale > bounds[1]:
                continue
            if not (
                _alike(there[i, 2], scale * here[k, 2], likeness) and _alike(there[j, 2], scale * here[m, 2], likeness)
            ):
                continue
            shift = p[i] - turn * q[k]
            count = 0
            for n in range(len(q)):
                moved = turn * q[n] + shift
                col, row = int((moved.real - left) // near), int((moved.imag - low) // near)
                if 0 <= row < beside.shape[0] and 0 <= col < beside.shape[1] and beside[row, col]:
                    count += 1
            if count >= least:
                counts.append(count)
                turns.append(turn)
                shifts.append(shift)
    return np.array(counts[1:]), np.array(turns[1:]), np.array(shifts[1:])


@njit(cache=True)
def _alike(a: float, b: float, factor: float) -> bool:
    return a <= factor * b and b <= factor * a
