"""``mapquilt study``: measure merging as one setting, or two, change."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.io.safe_load import printable
from mapping.io.transaction import write_files_atomically
from mapping.wording import counted
from mapquilt.cli.exit_status import Termination
from mapquilt.cli.options.workers import SchedulerOption, WorkersOption, chosen_workers
from mapquilt.cli.tables import print_table
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner
from mapquilt.study.folder import StudyRun, run_study
from mapquilt.study.plan import Method, plan_study
from mapquilt.study.plots import study_figures
from mapquilt.study.table import level_table, verdict_table
from mapquilt.study.variables import SWEEPS
from mapquilt.viz.png import figure_png
from merge.methods import method_names, published_names

DEFAULT_METHODS = ("quilt", "sift", "orb")


def study(
    out: Annotated[Path, typer.Option(help="Folder of the study; an unfinished one continues.")],
    sweep: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help=f"Named sweep: {', '.join(SWEEPS)}; omit it with --vary.")
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=V1,V2", help="Setting and its values, such as noise=0,1. At most two."),
    ] = None,
    fixed: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Setting of all levels, such as robots=2. Repeatable."),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(method_names())}. Repeatable; default: {', '.join(DEFAULT_METHODS)}."),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option("--as-published", help=f"Also run methods by their own rule: {', '.join(published_names())}."),
    ] = False,
    world: Annotated[
        list[str] | None, typer.Option(help="Family or file of the worlds. Repeatable; default: office.")
    ] = None,
    missions: Annotated[int, typer.Option(help="Missions per world.")] = 8,
    min_overlap: Annotated[float, typer.Option(help="Least true overlap of the pairs that count, 0 to 1.")] = 0.15,
    seed: Annotated[int, typer.Option(help="Seed of worlds, starts, noise, frames and intervals.")] = 1,
    cache: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder that keeps simulated missions, for this study and others."),
    ] = None,
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
) -> int:
    """Vary a setting on the same missions, and report shares with intervals, errors, map quality and time.

    Writes tables (CSV, JSON) and plots; `mapquilt report` shows them. After an interruption the same command continues.
    Exit status 1 if a mission failed. See docs/studies.md.

    Example: mapquilt study noise --out study
    """
    plan = plan_study(
        sweep, vary or (), fixed or (), _methods(method or DEFAULT_METHODS, as_published), world or ("office",),
        missions, seed, min_overlap,
    )  # fmt: skip
    with Runner(chosen_workers(workers, scheduler)) as runner, count_progress("missions") as on_progress:
        try:
            found = run_study(plan, out, None if cache is None else cache.resolve(), runner, on_progress)
        except (KeyboardInterrupt, Termination):
            typer.echo(f"mapquilt: {out} is unfinished; the same command continues from here", err=True)
            raise
    figures = study_figures(found.results)
    write_files_atomically({out / f"{name}.png": figure_png(figure) for name, figure in figures.items()})
    return _print(out, found)


def _methods(names: list[str] | tuple[str, ...], as_published: bool) -> list[Method]:
    chosen = []
    for name in names:
        chosen.append(Method(name))
        if as_published and name in published_names():
            chosen.append(Method(name, as_published=True))
    return chosen


def _print(out: Path, found: StudyRun) -> int:
    for warning in found.warnings:
        typer.echo(f"mapquilt: warning: {printable(warning)}", err=True)
    results = found.results
    print_table(level_table(results))
    if results.tests:
        print_table(verdict_table(results))
    for failure in results.failures:
        where = "" if failure.level is None else f" at {' '.join(failure.level)}"
        typer.echo(f"mapquilt: mission {failure.mission}{where} failed: {printable(failure.reason)}", err=True)
    missions = counted(len({team.mission for team in results.teams}), "mission")
    print_table(f"{out}: {counted(len(results.teams), 'merge')} of {missions}")
    return 1 if results.failures else 0
