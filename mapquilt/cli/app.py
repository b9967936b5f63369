"""The command line: a table of verbs, each loaded when it is called."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from mapquilt.cli.application import WholeHelpGroup, new_app
from mapquilt.cli.entry import run_app

VERBS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "simulate": ("mapquilt.cli.verbs.simulate:simulate", "Drive robots through a world and map it."),
        "sense": ("mapquilt.cli.verbs.sense:sense", "Map a mission again with other noise, without the simulator."),
        "map": ("mapquilt.cli.verbs.map:map_logs", "Draw the maps of real robots' logs."),
        "merge": ("mapquilt.cli.verbs.merge:merge", "Find the transforms between maps and merge them."),
        "locate": ("mapquilt.cli.verbs.locate:locate_scan", "Find the floor plan that a map belongs to."),
        "live": ("mapquilt.cli.verbs.live:live", "Merge the maps of running robots as they grow."),
        "play": ("mapquilt.cli.verbs.play:play", "Send a run's maps, scans and tf as running robots would."),
        "align": ("mapquilt.cli.verbs.align:align", "Align maps by hand on a page in the browser."),
        "score": ("mapquilt.cli.verbs.score:score", "Compare a run's merge with the ground truth."),
        "slam-eval": ("mapquilt.cli.verbs.slam_eval:slam_eval", "Evaluate a trajectory."),
        "worlds": ("mapquilt.cli.verbs.worlds:worlds_app", "List, draw and write worlds."),
        "lidars": ("mapquilt.cli.verbs.lidars:lidars", "List the lidar presets."),
        "dataset": ("mapquilt.cli.verbs.dataset:app", "Make and inspect data sets of map pairs."),
        "benchmark": ("mapquilt.cli.verbs.benchmark:app", "Score methods on pairs with a known transform."),
        "calibrate": ("mapquilt.cli.verbs.calibrate:calibrate", "Fit the merger's confidence to data sets."),
        "study": ("mapquilt.cli.verbs.study:study", "Vary a setting and measure the effect on merges."),
        "report": ("mapquilt.cli.verbs.report:report", "Turn results into one HTML file."),
        "convert": ("mapquilt.cli.verbs.convert:convert", "Write a map, a log or a run for other programs."),
    }
)
"""Each verb with the function or application that runs it, and its line in ``mapquilt --help``."""


class LazyGroup(WholeHelpGroup):
    """List the verbs without loading them, and load the one that is called."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for name, (_, help_line) in VERBS.items():
            self.add_command(TyperCommand(name, help=help_line))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args[0] in VERBS:
            self.add_command(load_verb(args[0]), args[0])
        return super().resolve_command(ctx, args)


def load_verb(name: str) -> Any:
    """Import a verb and return its command."""
    module, _, attribute = VERBS[name][0].partition(":")
    target = getattr(import_module(module), attribute)
    if not isinstance(target, typer.Typer):
        verb, target = target, new_app()
        target.command(name)(verb)
    command = typer.main.get_command(target)
    command.name = name
    return command


app = new_app(
    cls=LazyGroup,
    name="mapquilt",
    help="Simulate teams of robots that map a world, merge their occupancy grids, and score the merge against the "
    "ground truth.\n\nExit status: 0 all merged, 1 some map was refused, 2 bad input, 3 overlap not reached, "
    "70 internal error, 75 unfinished (the same command continues), 130 interrupted, 141 output pipe closed, "
    "143 terminated.\n\n"
    "Example: mapquilt merge floor_a.yaml floor_b.yaml --out merged",
)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"mapquilt {version('mapquilt')}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    pass


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status. Errors end here, in one line on standard error."""
    return run_app(app, arguments, "mapquilt")
