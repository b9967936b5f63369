"""What is told of each level and method: shares with intervals, errors, quality of the merged map, time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.seeds import Role, stream
from mapquilt.evaluation.statistics import LEVEL, RESAMPLES, Interval, Share, over_clusters
from mapquilt.study.plan import Level, StudyPlan
from mapquilt.study.setup import ExperimentConfig
from mapquilt.study.trial import PairTrial, TeamTrial


@dataclass(frozen=True)
class Spread:
    """Median and 90th percentile."""

    median: float
    p90: float


@dataclass(frozen=True)
class Mean:
    """A mean over missions, and its bootstrap interval; None with one mission."""

    value: float
    interval: Interval | None


@dataclass(frozen=True)
class Cell:
    """One method at one level.

    ``pairs`` are those that have one right answer and enough overlap; of them, how many were ``right`` and how many
    ``right_and_accepted``, with Wilson's intervals and, in ``over_missions``, those of a bootstrap over missions. Bent
    pairs are among them: a map that drift has bent past any transform is a merge that failed. ``wrong_accepts`` are
    of all pairs. Errors are those of accepted answers. ``acceptance_index`` is the median over answers; the merged
    map's ``iou_free`` and ``f1_walls`` are against what the team truly saw, ``joined`` is the share of maps that got
    into it.
    """

    level: Level
    method: str
    missions: int
    pairs: int
    bent: int
    right: Share | None
    right_and_accepted: Share | None
    over_missions: Interval | None
    wrong_accepts: Share | None
    rotation_deg: Spread | None
    scale_percent: Spread | None
    displacement_m: Spread | None
    displacement_of_diagonal: Spread | None
    acceptance_index: float | None
    iou_free: Mean | None
    f1_walls: Mean | None
    joined: Mean | None


@dataclass(frozen=True)
class CellTime:
    """Seconds of the processor that a pair took, the fusion included: over the missions of a level."""

    level: Level
    method: str
    median_s: float
    p10_s: float
    p90_s: float


def counts(trial: PairTrial, setup: ExperimentConfig, min_overlap: float) -> bool:
    """Whether a pair is asked for: it has one right answer, and the overlap that the level is about, or enough."""
    if setup.overlap is not None:
        return trial.identifiable and setup.overlap[0] <= trial.overlap <= setup.overlap[1] and trial.overlap > 0.0
    return trial.identifiable and trial.overlap >= min_overlap


def asked(plan: StudyPlan, pairs: Sequence[PairTrial]) -> list[PairTrial]:
    """The pairs that count."""
    setups = dict(plan.setups)
    return [trial for trial in pairs if counts(trial, setups[trial.level], plan.min_overlap)]


def count_cells(plan: StudyPlan, pairs: Sequence[PairTrial], teams: Sequence[TeamTrial]) -> tuple[Cell, ...]:
    """A cell for each level and method, in their order."""
    kept = {id(trial) for trial in asked(plan, pairs)}
    return tuple(
        _cell(
            plan,
            level,
            method.title,
            [trial for trial in pairs if (trial.level, trial.method) == (level, method.title)],
            [team for team in teams if (team.level, team.method) == (level, method.title)],
            kept,
        )
        for level in plan.levels
        for method in plan.methods
    )


def _cell(
    plan: StudyPlan, level: Level, method: str, pairs: list[PairTrial], teams: list[TeamTrial], kept: set[int]
) -> Cell:
    sought = [trial for trial in pairs if id(trial) in kept]
    hits = [trial.right and trial.accepted for trial in sought]
    missions = [trial.mission for trial in sought]
    believed = [trial for trial in sought if trial.accepted]
    answered = [trial.acceptance_index for trial in sought if trial.acceptance_index is not None]
    rng = stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 2)
    return Cell(
        level=level,
        method=method,
        missions=len(teams),
        pairs=len(sought),
        bent=sum(trial.bent for trial in sought),
        right=_share([trial.right for trial in sought]),
        right_and_accepted=_share(hits),
        over_missions=over_clusters(hits, missions, rng) if sought else None,
        wrong_accepts=_share([trial.accepted and not trial.right for trial in pairs]),
        rotation_deg=_spread(believed, lambda trial: trial.rotation_deg),
        scale_percent=_spread(believed, lambda trial: trial.scale_percent),
        displacement_m=_spread(believed, lambda trial: trial.displacement_m),
        displacement_of_diagonal=_spread(believed, lambda trial: trial.displacement_of_diagonal),
        acceptance_index=float(np.median(answered)) if answered else None,
        iou_free=_mean(plan, [team.iou_free for team in teams]),
        f1_walls=_mean(plan, [team.f1_walls for team in teams]),
        joined=_mean(plan, [team.joined / team.maps for team in teams]),
    )


def _share(hits: Sequence[bool]) -> Share | None:
    return Share.counted(hits) if hits else None


def _spread(trials: Sequence[PairTrial], part: Callable[[PairTrial], float | None]) -> Spread | None:
    values = [value for trial in trials if (value := part(trial)) is not None]
    if not values:
        return None
    median, p90 = np.quantile(values, (0.5, 0.9))
    return Spread(float(median), float(p90))


def _mean(plan: StudyPlan, values: Sequence[float]) -> Mean | None:
    if not values:
        return None
    found = np.array(values)
    return Mean(float(found.mean()), _mean_interval(found, stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 3)))


def _mean_interval(values: NDArray[np.float64], rng: np.random.Generator) -> Interval | None:
    if len(values) < 2:
        return None
    means = values[rng.integers(0, len(values), (RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.quantile(means, ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0))
    return Interval(float(low), float(high))


def cell_times(plan: StudyPlan, teams: Sequence[TeamTrial]) -> tuple[CellTime, ...]:
    """Times of each level and method that has any, in their order."""
    found = []
    for level in plan.levels:
        for method in plan.methods:
            each = [t.seconds / max(1, t.pairs) for t in teams if (t.level, t.method) == (level, method.title)]
            if each:
                p10, median, p90 = np.quantile(each, (0.1, 0.5, 0.9)).tolist()
                found.append(CellTime(level, method.title, median, p10, p90))
    return tuple(found)
