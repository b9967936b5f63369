"""Relative poses of maps that show the same place, suggested by patches that look alike.

Patches are found by a k-d tree, as words by the inverted file of a bag of words (Sivic and Zisserman 2003), and vote
for the relative pose that they suggest (weak geometric consistency, Jegou et al. 2008). Time grows as N log N with the
number of maps, where a comparison of all pairs grows as its square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2_array import Similarity2Array
from merge.retrieval.relative_poses import RelativePoses
from merge.retrieval.settings import RetrievalSettings
from merge.retrieval.wall_patches import WallPatches


def suggest_poses(maps: Sequence[WallPatches], settings: RetrievalSettings) -> RelativePoses:
    """Suggest relative poses of all pairs of maps of which some patches look alike; their scores are votes."""
    owner = np.repeat(np.arange(len(maps)), [len(each.points) for each in maps])
    if len(set(owner.tolist())) < 2:
        return RelativePoses.none()
    here, there, weights = _similar_patches(np.concatenate([each.waves for each in maps]), owner, settings)
    swapped = owner[here] > owner[there]
    here, there = np.where(swapped, there, here), np.where(swapped, here, there)
    middles = np.array([each.points.mean(axis=0) if len(each.points) else (0.0, 0.0) for each in maps])
    points = np.concatenate([each.points for each in maps]) - middles[owner]
    yaws = np.concatenate([each.yaws for each in maps])
    turn = (yaws[here] - yaws[there]) % math.tau
    cosine, sine = np.cos(turn), np.sin(turn)
    x = points[here, 0] - cosine * points[there, 0] + sine * points[there, 1]
    y = points[here, 1] - sine * points[there, 0] - cosine * points[there, 1]
    pair, turn, x, y, votes = _popular(owner[here] * len(maps) + owner[there], turn, x, y, weights, settings)
    targets, sources = np.divmod(pair, len(maps))
    to_middle, from_middle = (1j * middles[k, 1] + middles[k, 0] for k in (targets, sources))
    rotation = np.exp(1j * turn)
    moved = Similarity2Array(rotation, x + 1j * y + to_middle - rotation * from_middle)
    return RelativePoses(targets, sources, moved, votes)


def _similar_patches(
    waves: NDArray[np.float32], owner: NDArray[np.intp], settings: RetrievalSettings
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Find the patches of other maps that look most like each: indices of both (V,), and weights 0 to 1 (V,)."""
    from scipy.spatial import cKDTree  # only large teams need it

    varying = np.argsort(-waves.var(axis=0, dtype=np.float64), kind="stable")
    spread = np.sqrt(np.maximum(waves.std(axis=0, dtype=np.float64), 1e-6))
    scaled = (waves / spread).astype(np.float32)
    short = np.ascontiguousarray(scaled[:, varying[: settings.tree_waves]])
    most = min(settings.similar, len(waves))
    found = np.asarray(cKDTree(short).query(short, k=most)[1], np.intp).reshape(len(waves), most)
    here, there, squares = [], [], []
    for first in range(0, len(waves), 4096):
        part = found[first : first + 4096]
        own = np.arange(first, first + len(part))
        apart = ((scaled[own][:, None] - scaled[part]) ** 2).sum(axis=-1, dtype=np.float64)
        apart[owner[part] == owner[own][:, None]] = math.inf
        nearest = np.argsort(apart, axis=1, kind="stable")[:, : settings.nearest]
        best = np.take_along_axis(apart, nearest, axis=1)
        known = np.isfinite(best)
        here.append(np.broadcast_to(own[:, None], best.shape)[known])
        there.append(np.take_along_axis(part, nearest, axis=1)[known])
        squares.append(best[known])
    distances = np.concatenate(squares)
    usual = float(np.median(distances)) if len(distances) else 1.0
    return np.concatenate(here), np.concatenate(there), np.exp(-distances / max(usual, 1e-12))


Columns = tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Pairs, their turns, x, y and votes."""


def _popular(
    pair: NDArray[np.intp],
    turn: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    weights: NDArray[np.float64],
    settings: RetrievalSettings,
) -> Columns:
    """Sum the weights of the votes of each pair in bins of poses, and return the distinct poses with most votes.

    Bins overlap by half in each direction, so that no place lies on the border of all.
    """
    turns = round(math.tau / settings.turn_bin)
    found: list[Columns] = []
    for half_turn in (0.0, 0.5):
        for half_x in (0.0, 0.5):
            for half_y in (0.0, 0.5):
                bins = (
                    pair,
                    np.floor(turn / math.tau * turns + half_turn).astype(np.int64) % turns,
                    np.floor(x / settings.shift_bin + half_x).astype(np.int64),
                    np.floor(y / settings.shift_bin + half_y).astype(np.int64),
                )
                order = np.lexsort(bins[::-1])
                ordered, weight = np.stack(bins)[:, order], weights[order]
                first = np.flatnonzero(np.r_[True, (np.diff(ordered, axis=1) != 0).any(axis=0)])
                sums = np.add.reduceat(weight, first)
                shift_x, shift_y, cosine, sine = (
                    np.add.reduceat(weight * each[order], first) for each in (x, y, np.cos(turn), np.sin(turn))
                )
                kept = sums >= settings.least_votes
                mean = np.arctan2(sine, cosine), shift_x / sums, shift_y / sums
                found.append((ordered[0, first][kept], *(each[kept] for each in mean), sums[kept]))
    return _distinct([np.concatenate(column) for column in zip(*found, strict=True)], settings)


def _distinct(columns: Sequence[NDArray[np.float64]], settings: RetrievalSettings) -> Columns:
    """Keep the poses of each pair with most votes, of those that are nearly the same only one."""
    order = np.lexsort((-columns[4], columns[0]))
    pair, turn, x, y, votes = (column[order] for column in columns)
    left, kept = np.arange(len(pair)), []
    for _ in range(settings.poses_per_pair):
        pairs, first = np.unique(pair[left], return_index=True)
        kept.append(left[first])
        best = left[first][np.searchsorted(pairs, pair[left])]
        turned = np.abs((turn[left] - turn[best] + math.pi) % math.tau - math.pi)
        shifted = np.hypot(x[left] - x[best], y[left] - y[best])
        left = left[(turned > settings.turn_bin) | (shifted > 2.0 * settings.shift_bin)]
    chosen = np.sort(np.concatenate(kept))
    return pair[chosen].astype(np.intp), turn[chosen], x[chosen], y[chosen], votes[chosen]
