"""The score of a run: every pair's answer against its truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from mapping.ground_truth.truth import PairTruth
from mapping.map_set import MapSet
from mapquilt.evaluation.merged_score import MergedScore
from mapquilt.evaluation.transform_error import RIGHT, THESIS, TransformError, transform_error
from mapquilt.json_file import record_bytes
from mapquilt.merging.merge_file import MergeAnswer, PairRecord
from mapquilt.runs.truth_file import RunTruth

SCHEMA = "mapquilt-score/1"

Outcome = Literal["right", "wrong", "missed", "rightly refused"]
"""What became of a pair: an accepted one is right or wrong; a refused one was missed, or rightly refused where the
true footprints do not overlap or have more than one right answer."""


@dataclass(frozen=True)
class PairScore:
    """One pair's answer against its truth. ``right`` speaks of the candidate, accepted or not. ``bent`` says that the
    truth's own residual [m] exceeds half the allowed displacement, so that even a perfect answer may miss; None where
    no residual is known."""

    target: str
    source: str
    overlap: float
    identifiable: bool
    accepted: bool
    confidence: float
    reason: str | None
    error: TransformError | None
    right: bool
    right_thesis: bool
    acceptance_index: float | None
    residual_m: float | None
    bent: bool | None

    @property
    def outcome(self) -> Outcome:
        if self.accepted:
            return "right" if self.right else "wrong"
        return "missed" if self.identifiable else "rightly refused"


@dataclass(frozen=True)
class RunScore:
    """What became of each pair, and how true the merged map of each group is."""

    pairs: tuple[PairScore, ...]
    merged: tuple[MergedScore, ...] = ()

    def summary(self) -> dict[str, int]:
        outcomes = [pair.outcome for pair in self.pairs]
        return {
            "pairs": len(self.pairs),
            "accepted": sum(pair.accepted for pair in self.pairs),
            "right": sum(pair.right for pair in self.pairs),
            "right_and_accepted": outcomes.count("right"),
            "wrong_accepts": outcomes.count("wrong"),
            "missed": outcomes.count("missed"),
            "rightly_refused": outcomes.count("rightly refused"),
        }


def score_answer(maps: MapSet, truth: RunTruth, answer: MergeAnswer) -> RunScore:
    """Score every pair of an answer. Maps, truth and answer must be of one run."""
    return RunScore(tuple(_score_pair(maps, truth, pair) for pair in answer.pairs))


def _score_pair(maps: MapSet, truth: RunTruth, pair: PairRecord) -> PairScore:
    true_pair = truth.pairs[pair.target, pair.source]
    target, source = (maps.grids[maps.names.index(name)] for name in (pair.target, pair.source))
    target_scale = truth.robot(pair.target).truth.world_from_map.scale
    error = None
    if pair.target_from_source is not None:
        error = transform_error(target, source, true_pair.target_from_source, pair.target_from_source, target_scale)
    allowed = RIGHT.displacement_of_diagonal * target.known_diagonal * target_scale
    return PairScore(
        target=pair.target,
        source=pair.source,
        overlap=true_pair.footprints.overlap,
        identifiable=true_pair.footprints.identifiability.identifiable,
        accepted=pair.accepted,
        confidence=pair.confidence,
        reason=pair.reason,
        error=error,
        right=error is not None and RIGHT.holds(error),
        right_thesis=error is not None and THESIS.holds(error),
        acceptance_index=pair.acceptance_index,
        residual_m=true_pair.residual,
        bent=_bent(true_pair, allowed),
    )


def _bent(pair: PairTruth, allowed: float) -> bool | None:
    return None if pair.residual is None else pair.residual > allowed / 2.0


def score_bytes(path: Path, score: RunScore) -> bytes:
    """What score.json holds."""
    pairs: list[dict[str, Any]] = [{**dataclasses.asdict(pair), "outcome": pair.outcome} for pair in score.pairs]
    merged = [{**dataclasses.asdict(group), "maps": list(group.maps)} for group in score.merged]
    return record_bytes(path, "score", {"schema": SCHEMA, "merged": merged, "pairs": pairs, "summary": score.summary()})
