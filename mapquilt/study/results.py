"""Results of a study: every trial, and aggregates by level and method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mapping.seeds import Role, stream
from mapquilt.evaluation.aggregation import Aggregate, aggregate
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import Interval, mean_over_clusters
from mapquilt.settings import ExperimentConfig
from mapquilt.study.paired import PairedTest, paired_tests
from mapquilt.study.plan import Level, StudyPlan
from mapquilt.study.records import Failure, TeamTrial


@dataclass(frozen=True)
class Mean:
    """Mean over missions, and its bootstrap interval; None with one mission."""

    value: float
    interval: Interval | None


@dataclass(frozen=True)
class Cell:
    """One method at one level.

    ``pairs``: aggregate over all pairs; asked are those with one right answer and enough overlap (``is_asked``).
    Distorted pairs are among them: a map that drift has distorted past any transform is a merge that failed.
    ``iou_free`` and ``f1_walls`` compare the merged map with all that the team observed; ``joined`` is the share of
    maps that are part of it.
    """

    level: Level
    method: str
    missions: int
    pairs: Aggregate
    iou_free: Mean | None
    f1_walls: Mean | None
    joined: Mean | None


@dataclass(frozen=True)
class CellTime:
    """Processor seconds of a pair, the fusion included: quantiles over the missions of a level."""

    level: Level
    method: str
    median_s: float
    p10_s: float
    p90_s: float


@dataclass(frozen=True)
class StudyResults:
    """Trials in the order of missions, levels, methods and pairs, independent of the order of execution."""

    plan: StudyPlan
    pairs: tuple[EvaluatedPair, ...]
    teams: tuple[TeamTrial, ...]
    failures: tuple[Failure, ...]
    cells: tuple[Cell, ...]
    times: tuple[CellTime, ...]
    tests: tuple[PairedTest, ...]

    def cell(self, level: tuple[str, ...], method: str) -> Cell:
        return next(cell for cell in self.cells if (cell.level, cell.method) == (level, method))


def build_results(
    plan: StudyPlan, pairs: Sequence[EvaluatedPair], teams: Sequence[TeamTrial], failures: Sequence[Failure]
) -> StudyResults:
    """Aggregate all trials by level and method, and compare the methods."""
    return StudyResults(
        plan,
        tuple(pairs),
        tuple(teams),
        tuple(failures),
        build_cells(plan, pairs, teams),
        cell_times(plan, teams),
        paired_tests(plan, asked_pairs(plan, pairs)),
    )


def is_asked(one: EvaluatedPair, setup: ExperimentConfig, min_overlap: float) -> bool:
    """Decide if a method should find the pair's transform: there is exactly one right answer, and the overlap lies in
    the range of the level, or reaches the least one."""
    overlap = one.truth.overlap or 0.0
    if setup.mission.overlap is not None:
        return one.identifiable and setup.mission.overlap[0] <= overlap <= setup.mission.overlap[1]
    return one.identifiable and overlap >= min_overlap


def asked_pairs(plan: StudyPlan, pairs: Sequence[EvaluatedPair]) -> list[EvaluatedPair]:
    """Select the pairs whose transform a method should find."""
    setups = dict(plan.setups)
    return [one for one in pairs if is_asked(one, setups[one.pair.level], plan.min_overlap)]


def build_cells(plan: StudyPlan, pairs: Sequence[EvaluatedPair], teams: Sequence[TeamTrial]) -> tuple[Cell, ...]:
    """Build a cell for each level and method, in their order."""
    return tuple(
        _cell(
            plan,
            level,
            method.title,
            [one for one in pairs if (one.pair.level, one.method) == (level, method.title)],
            [team for team in teams if (team.level, team.method) == (level, method.title)],
        )
        for level in plan.levels
        for method in plan.methods
    )


def _cell(plan: StudyPlan, level: Level, method: str, pairs: list[EvaluatedPair], teams: list[TeamTrial]) -> Cell:
    new_rng = partial(stream, plan.seed, Role.BENCHMARK_BOOTSTRAP, 2)
    return Cell(
        level=level,
        method=method,
        missions=len(teams),
        pairs=aggregate(pairs, asked_pairs(plan, pairs), new_rng),
        iou_free=_mean(plan, [team.iou_free for team in teams]),
        f1_walls=_mean(plan, [team.f1_walls for team in teams]),
        joined=_mean(plan, [team.joined / team.maps for team in teams]),
    )


def _mean(plan: StudyPlan, values: Sequence[float]) -> Mean | None:
    if not values:
        return None
    rng = stream(plan.seed, Role.BENCHMARK_BOOTSTRAP, 3)
    return Mean(float(np.mean(values)), mean_over_clusters(values, range(len(values)), rng))


def cell_times(plan: StudyPlan, teams: Sequence[TeamTrial]) -> tuple[CellTime, ...]:
    """Take quantiles of the times of each level and method that has any, in their order."""
    found = []
    for level in plan.levels:
        for method in plan.methods:
            each = [t.seconds / max(1, t.pairs) for t in teams if (t.level, t.method) == (level, method.title)]
            if each:
                p10, median, p90 = np.quantile(each, (0.1, 0.5, 0.9)).tolist()
                found.append(CellTime(level, method.title, median, p10, p90))
    return tuple(found)
