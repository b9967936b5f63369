"""View of a live merge on a terminal: robots, pairs and the rate of the merge, in 80 columns."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from statistics import median

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.safe_load import printable
from mapping.wording import counted
from mapquilt.live.live_merger import LiveState
from mapquilt.live.pair_answers import KnownPair, Names
from mapquilt.live.placement import State
from mapquilt.live.settings import LiveSettings
from mapquilt.viz.text_table import plain_table

_STYLES = {State.JOINED: "green", State.SUSPECT: "yellow", State.CANDIDATE: "cyan", State.ALONE: "red"}
_LINES_BESIDES = 12
"""Lines of a view without its rows."""


class MergeRate:
    """Updates of the last ``window`` seconds."""

    def __init__(self, window: float = 30.0) -> None:
        self._window = window
        self._recent: deque[tuple[float, float]] = deque()

    def add(self, seconds: float, now: float) -> None:
        """Count an update that took so long [s] and ended at ``now`` [s]."""
        self._recent.append((now, seconds))

    def text(self, now: float) -> str:
        """Say how many updates a second were made, and how long they took."""
        while self._recent and now - self._recent[0][0] > self._window:
            self._recent.popleft()
        if not self._recent:
            return f"no update in the last {self._window:.0f} s"
        seconds = [each for _, each in self._recent]
        rate = len(seconds) / max(1.0, min(self._window, now - self._recent[0][0]))
        return f"{rate:.1f} updates/s, median {median(seconds):.2f} s, longest {max(seconds):.2f} s"


def overview(
    state: LiveState, now: float | None, rate: str, *, frozen: bool, settings: LiveSettings, height: int = 40
) -> RenderableType:
    """Draw a state at ``now`` [s], in at most ``height`` lines if the robots fit."""
    joined = f"{len(state.poses)} of {counted(len(state.robots), 'robot')} joined"
    head = Text.assemble(
        ("mapquilt live  ", "bold"),
        (joined, "green" if state.poses and len(state.poses) == len(state.robots) else "yellow"),
        ("  frozen" if frozen else "", "bold cyan"),
        f"\n{rate}",
    )
    if state.fused is not None:
        head.append(f"\nmerged map {_size(state.fused.merged)} m, cells of {state.fused.merged.frame.resolution:g} m")
    if not state.robots:
        return Group(head, Text("no map yet"))
    robots = _robots(state, now, settings)
    room = max(3, height - _LINES_BESIDES - len(state.robots))
    return Group(head, robots, *_pairs(list(state.pairs.items()), room))


def _robots(state: LiveState, now: float | None, settings: LiveSettings) -> Table:
    table = plain_table(
        ("robot", False), ("state", False), ("map [m]", True), ("age [s]", True), ("x, y [m]", True), ("yaw", True),
        ("reason", False),
    )  # fmt: skip
    for name, robot in state.robots.items():
        placement, pose = state.placements[name], state.poses.get(name)
        silent = now is not None and robot.is_silent(now, settings)
        table.add_row(
            printable(name),
            Text(placement.state.value, _STYLES[placement.state]),
            "-" if robot.grid is None else _size(robot.grid),
            "-" if now is None else Text(f"{now - robot.heard:.0f}", "red" if silent else ""),
            "-" if pose is None else f"{pose.x:.2f}, {pose.y:.2f}",
            "-" if pose is None else f"{math.degrees(pose.yaw):.1f}°",
            printable(robot.fault or ("silent" if silent else placement.reason)),
        )
    return table


def _size(grid: OccupancyGrid) -> str:
    rows, cols = grid.frame.shape
    return f"{cols * grid.frame.resolution:.1f} x {rows * grid.frame.resolution:.1f}"


def _pairs(pairs: Sequence[tuple[Names, KnownPair]], room: int) -> tuple[RenderableType, ...]:
    """Tabulate pairs; if there are more than ``room``, those that were matched last."""
    if not pairs:
        return ()
    shown = pairs if len(pairs) <= room else sorted(pairs, key=lambda pair: -pair[1].turn)[:room]
    table = plain_table(("pair", False), ("verdict", False), ("confidence", True), ("reason", False))
    for (target, source), entry in shown:
        answer = entry.answer
        table.add_row(
            printable(f"{target} <- {source}"),
            Text("accepted", "green") if answer.accepted else Text("refused", "yellow"),
            f"{answer.confidence:.2f}",
            "" if answer.accepted else answer.reason_text,
        )
    if len(shown) < len(pairs):
        table.caption = f"and {len(pairs) - len(shown)} more pairs, matched before"
    return (table,)
