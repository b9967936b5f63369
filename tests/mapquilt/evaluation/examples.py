"""Evaluated pairs that were never merged, for tests of statistics and tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.evaluation.transform_error import RIGHT, TransformError

GOOD = TransformError(0.1, 0.2, 0.3, 0.4, 0.005)
BAD = TransformError(90.0, 0.2, 9.0, 180.0, 0.5)

OF_TRUTH = ("overlap", "identifiable")
OF_ANSWER = ("method", "reason", "answer", "evidence", "normalised_error", "seconds", "distorted")


def info(name: str = "p", **fields: Any) -> PairInfo:
    """Name a pair whose map files do not exist."""
    return PairInfo(name, "a", "b", **{"suite": "made", "target_file": Path("a"), "source_file": Path("b")} | fields)


def evaluated(
    accepted: bool, error: TransformError | None, confidence: float = 0.5, negative: bool = False, **fields: Any
) -> EvaluatedPair:
    """Build an evaluated pair; ``fields`` are of ``PairInfo`` but for those of truth and answer."""
    truth = {name: fields.pop(name) for name in OF_TRUTH if name in fields}
    answer = {name: fields.pop(name) for name in OF_ANSWER if name in fields}
    return EvaluatedPair(
        pair=info(**fields),
        truth=GroundTruth(None if negative else Similarity2(), **truth),
        accepted=accepted,
        confidence=confidence,
        error=error,
        right=error is not None and RIGHT.holds(error),
        **{"method": "orb", "distorted": False, "seconds": 1.0} | answer,
    )


def benchmark_pair(name: str = "p", negative: bool = False, **fields: Any) -> BenchmarkPair:
    truth = GroundTruth(None if negative else Similarity2())
    return BenchmarkPair(info(name, **fields), Path("a"), Path("b"), truth)
