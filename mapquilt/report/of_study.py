"""Content of a report on a study."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.report.content import Chart, Content, Sheet
from mapquilt.study.files import load_results
from mapquilt.study.plots import errors_figure, quality_figure, success_figure, time_figure
from mapquilt.study.results import StudyResults
from mapquilt.study.table import NUMBERS, cell_texts, verdict_texts


def study_content(folder: Path) -> Content:
    """Read a study, finished or not. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    results = load_results(folder)
    plan = results.plan
    if not results.pairs:
        raise ValueError(f"{folder}: no mission of this study is done yet")
    seconds = {(team.mission, team.level, team.method): team.seconds / max(1, team.pairs) for team in results.teams}
    missions = len({team.mission for team in results.teams})
    wanted = plan.missions * len(plan.worlds)
    notes = [] if missions == wanted else [f"Not finished: {missions} of {wanted} missions."]
    return Content(
        kind="study",
        name=folder.resolve().name,
        settings={one.variable.axis: ", ".join(one.values) for one in plan.varied}
        | dict(plan.fixed)
        | {
            "methods": ", ".join(method.title for method in plan.methods),
            "worlds": ", ".join(plan.worlds),
            "missions": str(missions),
            "least overlap": f"{100 * plan.min_overlap:g} %",
            "seed": str(plan.seed),
        },
        answers=tuple(
            _answer(folder, one, seconds[one.pair.mission or "", one.pair.level, one.method]) for one in results.pairs
        ),
        charts=_charts(results),
        sheets=_sheets(results),
        notes=[*notes, *(f"Mission {failure.mission} failed: {failure.reason}" for failure in results.failures)],
    )


def _answer(folder: Path, one: EvaluatedPair, seconds: float) -> EvaluatedPair:
    """Name the map files by their full path, and add the mean time of the team's pairs."""
    target, source = (folder / file for file in (one.pair.target_file, one.pair.source_file) if file is not None)
    return replace(one, pair=replace(one.pair, target_file=target, source_file=source), seconds=seconds)


def _charts(results: StudyResults) -> list[Chart]:
    what = " and ".join(one.variable.title for one in results.plan.varied)
    shares = "; ".join(
        f"{cell.method} at {' '.join(cell.level)}: {100 * cell.pairs.true_accepts.value:.0f} %"
        for cell in results.cells
        if cell.pairs.true_accepts is not None
    )
    return [
        Chart(
            f"Success against {what}",
            success_figure(results),
            f"Shares of true and of false accepts against {what}. {shares}.",
            "Bars: Wilson's 95 % interval. Bands: a bootstrap over missions, which pairs of one mission share. "
            "The same missions and the same random draws at every level.",
        ),
        Chart(
            f"Errors against {what}",
            errors_figure(results),
            f"Displacement, rotation and scale errors of accepted answers against {what}, median to 90th percentile.",
            "Of accepted answers, right or wrong: the median, and up to the 90th percentile.",
        ),
        Chart(
            "The merged map against the true raster",
            quality_figure(results),
            f"Intersection over union of free space, F1 of walls and acceptance index against {what}.",
            "Means over missions with their bootstrap interval, against all that the team observed; "
            "the acceptance index needs no truth.",
        ),
        Chart(
            "Time of a pair",
            time_figure(results),
            f"Processor seconds of a pair against {what}, by method.",
            "On one thread: median over missions, 10th to 90th percentile.",
        ),
    ]


def _sheets(results: StudyResults) -> list[Sheet]:
    names = [(one.variable.name, False) for one in results.plan.varied]
    times = {(time.level, time.method): time for time in results.times}
    levels = Sheet(
        "Levels",
        "Shares in per cent with Wilson's 95 % interval; errors from the median to the 90th percentile of accepted "
        "answers; AI is the acceptance index.",
        [*names, ("method", False), *((name, True) for name in NUMBERS)],
        [[*cell.level, *cell_texts(cell, times.get((cell.level, cell.method)))] for cell in results.cells],
    )
    if not results.tests:
        return [levels]
    tests = Sheet(
        "Is one method better?",
        "An exact sign-flip test over missions on the same pairs, corrected by Holm for all tests of the study; the "
        "difference in points with a bootstrap over missions.",
        [("level", False), ("verdict", False), ("difference", True), ("true accepts alone", True), ("p, Holm", True)],
        [verdict_texts(test) for test in results.tests],
    )
    return [levels, tests]
