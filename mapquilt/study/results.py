"""What a study found: every trial, and all that is counted from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mapquilt.study.counting import Cell, CellTime, cell_times, count_cells
from mapquilt.study.paired import PairedTest, paired_tests
from mapquilt.study.plan import StudyPlan
from mapquilt.study.trial import Failure, PairTrial, TeamTrial


@dataclass(frozen=True)
class StudyResults:
    """Trials in the order of missions, levels, methods and pairs, whatever order they were made in."""

    plan: StudyPlan
    pairs: tuple[PairTrial, ...]
    teams: tuple[TeamTrial, ...]
    failures: tuple[Failure, ...]
    cells: tuple[Cell, ...]
    times: tuple[CellTime, ...]
    tests: tuple[PairedTest, ...]

    def cell(self, level: tuple[str, ...], method: str) -> Cell:
        return next(cell for cell in self.cells if (cell.level, cell.method) == (level, method))


def build_results(
    plan: StudyPlan, pairs: Sequence[PairTrial], teams: Sequence[TeamTrial], failures: Sequence[Failure]
) -> StudyResults:
    """Count everything."""
    return StudyResults(
        plan,
        tuple(pairs),
        tuple(teams),
        tuple(failures),
        count_cells(plan, pairs, teams),
        cell_times(plan, teams),
        paired_tests(plan, pairs),
    )
