"""What the default method says of a pair, as the golden files hold it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from mapping.map_set import MapSet
from mapquilt.benchmark.trial import one_thread
from mapquilt.evaluation.transform_error import RIGHT, transform_error
from merge.merger import match_maps
from merge.records.result import PairResult
from merge.settings import MergeSettings
from tests.regression.pairs import SEED, RegressionPair

Outcome = Literal["right", "wrong", "missed", "rightly refused"]
DECIMALS = 4


@dataclass(frozen=True)
class Verdict:
    """``sample`` is the hash of what was merged; errors are None where there was no answer or is no truth."""

    name: str
    sample: str
    overlap: float
    outcome: Outcome
    confidence: float
    rotation_deg: float | None
    scale_percent: float | None
    displacement_cells: float | None
    reason: str | None


def verdict(pair: RegressionPair) -> Verdict:
    """Merge a pair by the default method on one thread, and score it."""
    maps = MapSet(("target", "source"), (pair.target, pair.source), ("m", "m"), resolutions_trusted=pair.trusted)
    with one_thread():
        (result,) = match_maps(maps, MergeSettings(), SEED)
    error = None
    if pair.truth is not None and result.target_from_source is not None:
        error = transform_error(pair.target, pair.source, pair.truth, result.target_from_source, pair.target_scale)
    return Verdict(
        pair.name,
        pair.digest(),
        round(pair.overlap, DECIMALS),
        _outcome(pair, result, error is not None and RIGHT.holds(error)),
        round(result.confidence, DECIMALS),
        None if error is None else round(error.rotation_deg, DECIMALS),
        None if error is None else round(error.scale_percent, DECIMALS),
        None if error is None or error.displacement_cells is None else round(error.displacement_cells, DECIMALS),
        result.reason,
    )


def _outcome(pair: RegressionPair, result: PairResult, right: bool) -> Outcome:
    if result.accepted:
        return "right" if right else "wrong"
    return "missed" if pair.identifiable else "rightly refused"
