"""Each method's trials of a stratum, counted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from mapping.seeds import Role, stream
from mapquilt.benchmark.strata import Stratum
from mapquilt.benchmark.trial import Answer
from mapquilt.evaluation.statistics import Interval, Share, over_clusters, ratio_of_medians
from mapquilt.evaluation.transform_error import TransformError

REFERENCE = "orb"
"""The method whose time is the unit."""


@dataclass(frozen=True)
class Tally:
    """Counts of one method in one stratum; the median errors are those of right answers.

    ``over_missions`` holds the bootstrap intervals of the shares, where pairs come in missions.
    """

    group: str
    stratum: str
    method: str
    pairs: int
    right: Share | None
    right_and_accepted: Share | None
    wrong_accepts: Share
    over_missions: dict[str, Interval]
    rotation_deg: float | None
    scale_percent: float | None
    displacement_cells: float | None


@dataclass(frozen=True)
class Timing:
    """Median seconds of one method in one stratum, and how many times the median of plain ORB in the same run."""

    group: str
    stratum: str
    method: str
    median_s: float
    ratio: float | None
    interval: Interval | None


def tally(stratum: Stratum, method: int, seed: int) -> Tally:
    """Count the answers of the method at this place in the trials' order."""
    answers = [trial.answers[method] for trial in stratum.trials]
    hits = {
        "right": [answer.right for answer in answers],
        "right_and_accepted": [answer.right and answer.accepted for answer in answers],
        "wrong_accepts": [answer.accepted and not answer.right for answer in answers],
    }
    if not stratum.has_truth:
        hits = {"wrong_accepts": hits["wrong_accepts"]}
    shares = {name: Share.counted(values) for name, values in hits.items()}
    errors = [answer.error for answer in answers if stratum.has_truth and answer.right and answer.error]
    return Tally(
        stratum.group,
        stratum.name,
        answers[0].method,
        len(answers),
        shares.get("right"),
        shares.get("right_and_accepted"),
        shares["wrong_accepts"],
        _over_missions(stratum, hits, seed),
        _median(errors, lambda error: error.rotation_deg),
        _median(errors, lambda error: error.scale_percent),
        _median(errors, lambda error: error.displacement_cells or 0.0),
    )


def _over_missions(stratum: Stratum, hits: dict[str, list[bool]], seed: int) -> dict[str, Interval]:
    missions = [trial.pair.mission for trial in stratum.trials]
    if None in missions:
        return {}
    found = {}
    for name, values in hits.items():
        interval = over_clusters(values, missions, stream(seed, Role.BENCHMARK_BOOTSTRAP))
        if interval is not None:
            found[name] = interval
    return found


def _median(errors: Sequence[TransformError], part: Callable[[TransformError], float]) -> float | None:
    return median(part(error) for error in errors) if errors else None


def timing(stratum: Stratum, method: int, seed: int) -> Timing:
    """Time the method at this place in the trials' order against the reference, where that ran as well."""
    answers = [trial.answers[method] for trial in stratum.trials]
    references = [_reference(trial.answers) for trial in stratum.trials]
    seconds = np.array([answer.seconds for answer in answers])
    ratio, interval = None, None
    beside = [answer.seconds for answer in references if answer is not None]
    if len(beside) == len(answers):
        rng = stream(seed, Role.BENCHMARK_BOOTSTRAP, 1)
        ratio, interval = ratio_of_medians(seconds, np.array(beside), rng)
    return Timing(stratum.group, stratum.name, answers[0].method, float(np.median(seconds)), ratio, interval)


def _reference(answers: Sequence[Answer]) -> Answer | None:
    return next((answer for answer in answers if answer.method == REFERENCE), None)
