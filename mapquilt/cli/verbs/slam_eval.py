"""``mapquilt slam-eval``: measure the errors of a trajectory."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from mapping.io.atomic import write_bytes_atomically
from mapping.io.relations_file import load_relations
from mapping.io.transaction import atomic_folder
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import path
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.slam_evaluation import SlamEvaluation, evaluate_trajectory, evaluation_record
from mapquilt.evaluation.trajectory_error import MAX_DIFFERENCE, MotionError, Spread, Unit
from mapquilt.json_file import write_record
from mapquilt.logs.load_trajectory import POSES, load_trajectory
from mapquilt.runs import folder as run_folder
from mapquilt.viz.png import figure_png
from mapquilt.viz.text_table import plain_table

RECORD = "slam_eval.json"
PICTURE = "slam_eval.png"
KINDS = "TUM trajectory, map folder of `map`, log or run"


def slam_eval(
    estimate: Annotated[Path, typer.Argument(metavar="ESTIMATE", help=f"{KINDS}.")],
    reference: Annotated[
        Path | None, typer.Option(metavar="REF", help=f"{KINDS} with the reference or true poses.")
    ] = None,
    relations: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Relations: lines `stamp1 stamp2 x y z roll pitch yaw` [s, m, rad]."),
    ] = None,
    poses: Annotated[str, typer.Option(help=f"Poses of ESTIMATE if it is a log: {', '.join(POSES)}.")] = POSES[0],
    robot: Annotated[str | None, typer.Option(help="Robot to evaluate, if a run has several.")] = None,
    metres: Annotated[
        list[float] | None,
        typer.Option(help="Path length of relative errors [m]. Repeatable. [default: 1, 10]"),
    ] = None,
    seconds: Annotated[
        list[float] | None, typer.Option(help="Time span of relative errors [s]. Repeatable. [default: 1]")
    ] = None,
    max_difference: Annotated[
        float, typer.Option(help="Largest difference of the stamps of one pose [s].")
    ] = MAX_DIFFERENCE,
    out: Annotated[
        Path | None, typer.Option(parser=path, help=f"Folder to write: {RECORD} and, with a reference, {PICTURE}.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print only the record, on standard output.")] = False,
) -> int:
    """Evaluate a trajectory against a reference, known relative poses, or both.

    Example: mapquilt slam-eval maps/floor --reference floor.log.gz
    """
    if reference is None and relations is None:
        raise ValueError("--reference or --relations: one of them must be given")
    chosen = next((one for one in POSES if one == poses), None)
    if chosen is None:
        raise ValueError(f"--poses {poses}: must be one of {', '.join(POSES)}")
    windows = _windows(metres or [1.0, 10.0], seconds or [1.0])
    if not max_difference >= 0.0:
        raise ValueError(f"--max-difference {max_difference:g}: must be at least 0 s")
    if out is not None:
        run_folder.refuse_foreign(out, RECORD)
    evaluation = evaluate_trajectory(
        load_trajectory(estimate, chosen, robot),
        None if reference is None else load_trajectory(reference, "reference", robot),
        None if relations is None else load_relations(relations),
        windows,
        max_difference,
    )
    record = evaluation_record(evaluation, str(estimate), None if reference is None else str(reference))
    if out is not None:
        with atomic_folder(out, ledger=True) as folder:
            _write(folder, evaluation, record)
    if as_json:
        typer.echo(json.dumps(record, allow_nan=False))
    else:
        print_table(_table(evaluation))
    return ALL_MERGED


def _windows(metres: list[float], seconds: list[float]) -> list[tuple[float, Unit]]:
    windows: list[tuple[float, Unit]] = [*((length, "m") for length in metres), *((length, "s") for length in seconds)]
    for length, unit in windows:
        if not (math.isfinite(length) and length > 0.0):
            raise ValueError(f"--{'metres' if unit == 'm' else 'seconds'} {length:g}: must be positive")
    return windows


def _write(folder: Path, evaluation: SlamEvaluation, record: dict[str, object]) -> None:
    write_record(folder / RECORD, "slam_eval", record)
    if (error := evaluation.absolute) is not None:
        from mapquilt.viz.trajectory_picture import trajectory_figure

        figure = trajectory_figure(error.stamps, error.estimate, error.reference, error.position, error.yaw)
        write_bytes_atomically(folder / PICTURE, figure_png(figure))


def _table(evaluation: SlamEvaluation) -> Table:
    """Tabulate all errors, each with its unit."""
    numbers = ("pairs", "RMSE", "mean", "median", "max", "std")
    table = plain_table(("error", False), ("unit", False), *((name, True) for name in numbers))
    if (absolute := evaluation.absolute) is not None:
        pairs = str(len(absolute.stamps))
        table.add_row("absolute position", "m", pairs, *_numbers(Spread.of(absolute.position)))
        table.add_row("absolute yaw", "deg", pairs, *_numbers(Spread.of(absolute.yaw), degrees=True))
    for one in evaluation.relative:
        _add_motion(table, f"relative, {one.length:g} {one.unit}", one.error)
    if evaluation.relations is not None:
        _add_motion(table, "relations", evaluation.relations)
        table.caption = f"relations: {evaluation.relations.pairs} of {evaluation.relations_known} match the stamps"
    return table


def _add_motion(table: Table, name: str, error: MotionError | None) -> None:
    if error is None:
        table.add_row(name, "", "0", *"-----")
        return
    table.add_row(name, "m", str(error.pairs), *_numbers(error.translation))
    table.add_row("", "deg", str(error.pairs), *_numbers(error.rotation, degrees=True))


def _numbers(spread: Spread, degrees: bool = False) -> tuple[str, ...]:
    factor = math.degrees(1.0) if degrees else 1.0
    values = (spread.rmse, spread.mean, spread.median, spread.max, spread.std)
    return tuple(f"{factor * value:.3f}" for value in values)
