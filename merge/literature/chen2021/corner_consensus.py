"""Similarities that put most corners of one map on corners of the other, by voting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.validation import require_valid

Complex = NDArray[np.complex128]
"""Points x + i y, so that a turn is a product."""

Cells = NDArray[np.float64]
"""Points (N, 2) x, y in cells."""


@dataclass(frozen=True)
class ConsensusSettings:
    """Distances in cells of the coarser map.

    - ``inlier_distance_cells``: Chen's 5 pixels;
    - ``most_corners``: the strongest corners of each map vote;
    - ``finest_step``: least difference of the rotations [rad] and log scales that are tried;
    - ``coarse_steps``: where no main direction is known, rotations and scales are first tried so many steps apart, then
      all around the best of those;
    - ``peaks``, ``fitted``: so many shifts of each turn and scale, and in all so many similarities, are looked at;
    - ``distinct_cells``: mean displacement of the corners from which on two similarities are distinct;
    - ``min_inliers``: a similarity has at least so many corner pairs.
    """

    inlier_distance_cells: float = 5.0
    most_corners: int = 250
    finest_step: float = 1.0 / 60.0
    coarse_steps: float = 2.0
    peaks: int = 8
    fitted: int = 96
    refits: int = 3
    distinct_cells: float = 10.0
    min_inliers: int = 3

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True, eq=False)
class CornerMatch:
    """A similarity, cells to cells, and its corner pairs: indices (M,) into the corners of each map."""

    target_from_source: Similarity2
    target: NDArray[np.intp]
    source: NDArray[np.intp]
    matches: int

    @property
    def inliers(self) -> int:
        return len(self.source)


def corner_consensus(
    target: Cells,
    source: Cells,
    turns: Sequence[float] | None,
    scale: ScaleRange,
    settings: ConsensusSettings = ConsensusSettings(),
) -> list[CornerMatch]:
    """Find distinct similarities with many corner pairs, by falling number; none if no similarity has enough.

    Chen 2021 runs RANSAC on all point pairs of two clusters of k-means. Here every pair votes: for each rotation and
    scale it fixes the shift, and the shifts of most votes win (Ballard 1981). ``turns`` [rad] are the rotations to try,
    the four quarter turns if both maps have a main direction; None tries all. Nothing is random. The winners are fitted
    to their inliers, each corner in one pair only.
    """
    if min(len(target), len(source)) < settings.min_inliers:
        return []
    there, here = target[: settings.most_corners], source[: settings.most_corners]
    middle = here.mean(axis=0)
    reach = max(float(np.hypot(*(here - middle).T).max()), 1.0)
    coarser = max(1.0, math.sqrt(scale.low * scale.high))
    gate = settings.inlier_distance_cells * coarser
    step = max(gate / (coarser * reach), settings.finest_step)

    def votes_for(tried: Complex) -> Complex:
        return _votes(_complex(there), _complex(here - middle), tried, gate, settings.peaks, settings.fitted)

    if turns is None:
        coarse = _strongest(votes_for(_tried(None, scale, settings.coarse_steps * step)), settings)
        around = _around(coarse[:, 1], scale, step, settings.coarse_steps)
        votes = np.concatenate((coarse, votes_for(around)))
    else:
        votes = votes_for(_tried(turns, scale, step))
    found: list[CornerMatch] = []
    from scipy.spatial import cKDTree  # here: loading it takes a tenth of a merge, and other methods do without

    tree = cKDTree(target)
    for turn, shift in _strongest(votes, settings)[:, 1:].tolist():
        rough = _similarity(turn, shift - turn * complex(middle[0], middle[1]))
        fit = _refit(target, tree, source, rough, scale, settings)
        if fit is not None and all(_are_distinct(fit, other, source, settings) for other in found):
            found.append(fit)
    return sorted(found, key=lambda agreement: -agreement.inliers)


def _tried(turns: Sequence[float] | None, scale: ScaleRange, step: float) -> Complex:
    if turns is None:
        count = math.ceil(math.tau / step)
        turns = [k * math.tau / count for k in range(count)]
    steps = math.ceil(math.log(scale.high / scale.low) / step)
    sizes = np.geomspace(scale.low, scale.high, steps + 1)
    return np.asarray((sizes[:, None] * np.exp(1j * np.asarray(turns))[None, :]).ravel())


def _around(tried: Complex, scale: ScaleRange, step: float, reach: float) -> Complex:
    """Return the rotations and scales less than ``reach`` steps around those that were tried, each once."""
    offsets = np.arange(1 - math.ceil(reach), math.ceil(reach)) * step
    turns, sizes = np.unique(np.stack((np.angle(tried), np.abs(tried)), axis=-1).round(9), axis=0).T
    near = turns[:, None, None] + offsets[:, None]
    grown = np.clip(sizes[:, None, None] * np.exp(offsets), scale.low, scale.high)
    pairs = np.stack(np.broadcast_arrays(near, grown), axis=-1).reshape(-1, 2)
    turns, sizes = np.unique(pairs.round(9), axis=0).T
    return np.asarray(sizes * np.exp(1j * turns))


def _strongest(votes: Complex, settings: ConsensusSettings) -> Complex:
    """Select the rows of most votes, of equals the first."""
    return votes[np.argsort(-votes[:, 0].real, kind="stable")[: settings.fitted]]


def _complex(points: Cells) -> Complex:
    return np.asarray(points[:, 0] + 1j * points[:, 1])


@njit(cache=True)
def _votes(target: Complex, source: Complex, turns: Complex, gate: float, peaks: int, most: int) -> Complex:
    """Return votes, turn and shift (K, 3) of the strongest shifts of each turn; bins of ``gate`` count two by two.

    Shifts are left out that ``most`` others before them outdo or equal.
    """
    found = np.zeros((len(turns) * peaks, 3), np.complex128)
    count, strongest, least = 0, np.zeros(most, np.int64), 0
    x, y = target.real / gate, target.imag / gate
    for t in range(len(turns)):
        moved = source * (turns[t] / gate)
        low_x, low_y = x.min() - moved.real.max(), y.min() - moved.imag.max()
        cols = int(x.max() - moved.real.min() - low_x) + 2
        rows = int(y.max() - moved.imag.min() - low_y) + 2
        bins, highest = np.zeros((rows, cols), np.int32), 0
        for i in range(len(moved)):
            off_x, off_y = moved[i].real + low_x, moved[i].imag + low_y
            for k in range(len(x)):
                row, col = int(y[k] - off_y), int(x[k] - off_x)
                bins[row, col] += 1
                highest = max(highest, bins[row, col])
        if 4 * highest <= strongest[least]:
            continue
        for _ in range(peaks):
            best, best_row, best_col = 0, 0, 0
            for row in range(rows - 1):
                above = bins[row, 0] + bins[row + 1, 0]
                for col in range(cols - 1):
                    here = bins[row, col + 1] + bins[row + 1, col + 1]
                    if above + here > best:
                        best, best_row, best_col = above + here, row, col
                    above = here
            if best <= strongest[least]:
                break
            bins[best_row : best_row + 2, best_col : best_col + 2] = 0
            strongest[least] = best
            least = int(np.argmin(strongest))
            shift = complex((low_x + best_col + 1) * gate, (low_y + best_row + 1) * gate)
            found[count, 0], found[count, 1], found[count, 2] = best, turns[t], shift
            count += 1
    return found[:count]


def _refit(
    target: Cells,
    tree: Any,
    source: Cells,
    rough: Similarity2,
    scale: ScaleRange,
    settings: ConsensusSettings,
) -> CornerMatch | None:
    fit = rough
    for attempt in range(settings.refits + 1):
        gate = settings.inlier_distance_cells * max(1.0, fit.scale) * (2.0 if attempt == 0 else 1.0)
        there, here = _partners(tree, fit.apply(source), gate)
        if len(here) < settings.min_inliers:
            return None
        if attempt == settings.refits:
            break
        better = fit_similarity(target[there], source[here], scale)
        if better is None:
            return None
        fit = better
    return CornerMatch(fit, there, here, len(source))


def _partners(tree: Any, moved: Cells, gate: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match target and source corners that are nearest to each other, at most ``gate`` apart; return their indices."""
    found = tree.query(moved, distance_upper_bound=gate)
    distance, nearest = np.asarray(found[0], np.float64), np.asarray(found[1], np.intp)
    order = np.argsort(distance, kind="stable")
    order = order[np.isfinite(distance[order])]
    there, first = np.unique(nearest[order], return_index=True)
    return there, order[first]


def _similarity(turn: complex, shift: complex) -> Similarity2:
    return Similarity2(shift.real, shift.imag, math.atan2(turn.imag, turn.real), abs(turn))


def _are_distinct(a: CornerMatch, b: CornerMatch, source: Cells, settings: ConsensusSettings) -> bool:
    displacement = np.hypot(*(a.target_from_source.apply(source) - b.target_from_source.apply(source)).T)
    return bool(displacement.mean() > settings.distinct_cells * max(1.0, a.target_from_source.scale))
