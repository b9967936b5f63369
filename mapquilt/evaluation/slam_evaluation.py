"""The evaluation of a trajectory: all errors, and their record."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mapping.io.relations_file import Relations
from mapping.robot.trajectory import Trajectory
from mapquilt.evaluation.trajectory_error import (
    MAX_DIFFERENCE,
    AbsoluteError,
    MotionError,
    RelativeError,
    Spread,
    Unit,
    absolute_error,
    matched,
    relations_error,
    relative_error,
)

SCHEMA = "mapquilt-slam-eval/1"


@dataclass(frozen=True)
class SlamEvaluation:
    """Errors of a trajectory: ``absolute`` and ``relative`` against a reference, and over ``relations``, of which
    ``relations_known`` are all in the file. None without a reference, or without relations."""

    absolute: AbsoluteError | None
    relative: tuple[RelativeError, ...]
    relations: MotionError | None
    relations_known: int | None


def evaluate_trajectory(
    estimate: Trajectory,
    reference: Trajectory | None,
    relations: Relations | None,
    windows: Sequence[tuple[float, Unit]],
    max_difference: float = MAX_DIFFERENCE,
) -> SlamEvaluation:
    """Measure an estimate against a reference and over relations, each if it is given.

    Raises ``ValueError`` if the stamps do not match.
    """
    absolute: AbsoluteError | None = None
    relative: tuple[RelativeError, ...] = ()
    if reference is not None:
        mine, theirs = matched(estimate, reference, max_difference)
        absolute = absolute_error(mine, theirs)
        relative = tuple(relative_error(mine, theirs, length, unit) for length, unit in windows)
    return SlamEvaluation(
        absolute,
        relative,
        None if relations is None else relations_error(estimate, relations),
        None if relations is None else len(relations.stamps),
    )


def evaluation_record(evaluation: SlamEvaluation, estimate: str, reference: str | None) -> dict[str, Any]:
    """Describe an evaluation; ``estimate`` and ``reference`` name the files."""
    absolute = evaluation.absolute
    return {
        "schema": SCHEMA,
        "estimate": estimate,
        "reference": reference,
        "poses": None if absolute is None else len(absolute.stamps),
        "absolute": None if absolute is None else _absolute_record(absolute),
        "relative": [
            {"length": one.length, "unit": one.unit, "error": None if one.error is None else _motion_record(one.error)}
            for one in evaluation.relative
        ],
        "relations": None
        if evaluation.relations is None
        else {"known": evaluation.relations_known, **_motion_record(evaluation.relations)},
    }


def _absolute_record(error: AbsoluteError) -> dict[str, Any]:
    motion = error.reference_from_estimate
    return {
        "reference_from_estimate": {"x": motion.x, "y": motion.y, "yaw": motion.yaw},
        "position_m": dataclasses.asdict(Spread.of(error.position)),
        "yaw_deg": _in_degrees(Spread.of(error.yaw)),
    }


def _motion_record(error: MotionError) -> dict[str, Any]:
    return {
        "pairs": error.pairs,
        "translation_m": dataclasses.asdict(error.translation),
        "rotation_deg": _in_degrees(error.rotation),
    }


def _in_degrees(spread: Spread) -> dict[str, float]:
    return {name: math.degrees(value) for name, value in dataclasses.asdict(spread).items()}
