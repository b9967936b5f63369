"""Trials as they might have come out, without running anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.trial import Answer, Trial
from mapquilt.evaluation.transform_error import TransformError

GOOD = TransformError(0.1, 0.2, 0.3, 0.4, 0.005)
BAD = TransformError(90.0, 0.2, 9.0, 180.0, 0.5)


def pair(name: str = "p", negative: bool = False, **fields: Any) -> BenchmarkPair:
    """A pair whose maps are nowhere."""
    return BenchmarkPair("made", name, Path("a"), Path("b"), None if negative else Similarity2(), **fields)


def answer(accepted: bool, error: TransformError | None, confidence: float = 0.5, **fields: Any) -> Answer:
    """An answer of the method ``orb``, unless told otherwise."""
    told = {"method": "orb", "reason": None, "target_from_source": None, "evidence": None, "seconds": 1.0} | fields
    return Answer(accepted=accepted, confidence=confidence, error=error, **told)


def trial(of: BenchmarkPair, *answers: Answer, bent: bool = False) -> Trial:
    """The pair with its answers."""
    return Trial(of, bent, answers)
