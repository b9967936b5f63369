"""Guided matching: a pair matched near a relative pose that is known from the rest of the team or from a prior."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from merge.pair.feature_cache import FeatureCache, metres_from_prepared
from merge.pair.matching import PairTask, to_result
from merge.pair.pipeline import merge_pair_near
from merge.records.prior import Expected
from merge.records.result import PairResult


@dataclass(frozen=True, eq=False)
class GuidedTask:
    """A pair to match near a ``guess``: target_from_source in metres, or a range of poses that a prior expects."""

    pair: PairTask
    guess: Similarity2 | Expected


def match_near(task: GuidedTask, cache: FeatureCache | None = None) -> PairResult:
    """Match a pair near its guess; other poses with a similar score do not make it ambiguous."""
    pair = task.pair
    features = pair.features(cache)
    metres = [metres_from_prepared(grid.frame, each.prepared) for grid, each in zip(pair.grids, features, strict=True)]
    scale = pair.in_cells(pair.scale, features)
    if isinstance(task.guess, Expected):
        guesses = task.guess.starts(features[0].prepared.diagonal, *metres)
    else:
        guesses = [metres[0].inverse() @ task.guess @ metres[1]]
    guesses = [dataclasses.replace(guess, scale=scale.clip(guess.scale)) for guess in guesses]
    return to_result(pair, merge_pair_near(*features, guesses, scale, pair.settings), features)
