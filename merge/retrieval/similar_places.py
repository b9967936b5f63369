"""Scores of which maps show the same place, from patches that look alike and agree on one relative pose.

Patches are found by a k-d tree, as words by the inverted file of a bag of words (Sivic and Zisserman 2003), and vote
for the relative pose that they suggest (weak geometric consistency, Jegou et al. 2008). Time grows as N log N with the
number of maps, where a comparison of all pairs grows as its square.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from merge.retrieval.settings import RetrievalSettings
from merge.retrieval.wall_patches import WallPatches


def place_scores(maps: Sequence[WallPatches], settings: RetrievalSettings) -> csr_array:
    """Score how likely maps show the same place: a sparse symmetric matrix (N, N), 0 for pairs without any vote."""
    owner = np.repeat(np.arange(len(maps)), [len(each.points) for each in maps])
    if len(owner) < 2:
        return csr_array((len(maps), len(maps)))
    here, there, weights = _similar_patches(np.concatenate([each.waves for each in maps]), owner, settings)
    votes = _agreeing_votes(maps, owner, here, there, weights, settings)
    return csr_array(votes + votes.T)


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


def _agreeing_votes(
    maps: Sequence[WallPatches],
    owner: NDArray[np.intp],
    here: NDArray[np.intp],
    there: NDArray[np.intp],
    weights: NDArray[np.float64],
    settings: RetrievalSettings,
) -> csr_array:
    """Sum the weights of the votes of each pair of maps for its most popular relative pose: (N, N)."""
    points = np.concatenate([each.points - each.points.mean(axis=0) for each in maps if len(each.points)])
    yaws = np.concatenate([each.yaws for each in maps])
    turn = (yaws[here] - yaws[there]) % math.tau
    cosine, sine = np.cos(turn), np.sin(turn)
    x = points[here, 0] - cosine * points[there, 0] + sine * points[there, 1]
    y = points[here, 1] - sine * points[there, 0] - cosine * points[there, 1]
    pair = owner[here] * len(maps) + owner[there]
    turns = round(math.tau / settings.turn_bin)
    pairs, index = np.unique(pair, return_inverse=True)
    most = np.zeros(len(pairs))
    for half_turn in (0.0, 0.5):
        for half_shift in (0.0, 0.5):
            bins = (
                index,
                np.floor(turn / math.tau * turns + half_turn).astype(np.int64) % turns,
                np.floor(x / settings.shift_bin + half_shift).astype(np.int64),
                np.floor(y / settings.shift_bin + half_shift).astype(np.int64),
            )
            order = np.lexsort(bins[::-1])
            ordered = np.stack(bins)[:, order]
            first = np.flatnonzero(np.r_[True, (np.diff(ordered, axis=1) != 0).any(axis=0)])
            sums = np.add.reduceat(weights[order], first)
            np.maximum.at(most, ordered[0, first], sums)
    rows, cols = np.divmod(pairs, len(maps))
    return csr_array((most, (rows, cols)), shape=(len(maps), len(maps)))
