"""Robots that were heard: their last map, its version, and what is wrong with what they send."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.live.received_map import MapMessage, MapPatch, grid_of, kept_share, patched
from mapquilt.live.settings import LiveSettings


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot as last heard.

    ``message`` is its last usable map and ``grid`` the same, without the unknown border; ``version`` counts the maps
    whose cells or frame changed, ``life`` its restarts; ``heard`` is the time [s] of its last message, usable or not;
    ``fault`` says what was wrong with that, ``notes`` what is worth saying of the last one.
    """

    name: str
    message: MapMessage | None = None
    grid: OccupancyGrid | None = None
    version: int = 0
    life: int = 0
    heard: float = 0.0
    fault: str = ""
    notes: tuple[str, ...] = field(default=())

    @property
    def known_cells(self) -> int:
        return 0 if self.grid is None else int(np.count_nonzero(self.grid.known))

    @property
    def middle(self) -> NDArray[np.float64]:
        """Middle (2,) of the map [m], in its frame."""
        if self.grid is None:
            return np.zeros(2)
        rows, cols = self.grid.frame.shape
        middle: NDArray[np.float64] = self.grid.frame.metres_from_cells([(rows / 2.0 - 0.5, cols / 2.0 - 0.5)])[0]
        return middle

    def is_silent(self, now: float, settings: LiveSettings) -> bool:
        """Check if nothing was heard for long."""
        return now - self.heard > settings.silent_after


def heard(robot: Robot, message: MapMessage | MapPatch, now: float, settings: LiveSettings = LiveSettings()) -> Robot:
    """Return the robot after a message that came at ``now`` [s].

    A message that cannot be used changes nothing but ``heard`` and ``fault``.
    """
    robot = replace(robot, heard=now, fault="", notes=())
    try:
        if isinstance(message, MapPatch):
            if robot.message is None:
                raise ValueError("an update came before the first map")
            message = patched(robot.message, message)
        grid = grid_of(message, settings)
    except ValueError as error:
        return replace(robot, fault=str(error))
    grid = grid.cropped()
    before, last = robot.grid, robot.message
    if before is None or last is None:
        return replace(robot, message=message, grid=grid, version=robot.version + 1)
    restart = _restart(last, before, message, grid, settings)
    if restart:
        return replace(
            robot, message=message, grid=grid, version=robot.version + 1, life=robot.life + 1, notes=(restart,)
        )
    notes: tuple[str, ...] = ()
    if last.resolution != message.resolution:
        notes = (f"resolution changed from {last.resolution:g} to {message.resolution:g} m",)
    same = grid.frame == before.frame and np.array_equal(grid.log_odds, before.log_odds)
    return replace(robot, message=message, grid=grid, version=robot.version + (not same), notes=notes)


def told_silence(
    robots: Mapping[str, Robot], silent: frozenset[str], now: float, settings: LiveSettings = LiveSettings()
) -> tuple[frozenset[str], tuple[str, ...]]:
    """Return the robots that are silent now, and tell which fell silent and which spoke again since ``silent``."""
    quiet = frozenset(name for name, robot in robots.items() if robot.is_silent(now, settings))
    events = [f"{name}: silent for {now - robots[name].heard:.0f} s; its last map stays" for name in quiet - silent]
    events += [f"{name}: heard again" for name in silent - quiet]
    return quiet, tuple(sorted(events))


def _restart(
    last: MapMessage, before: OccupancyGrid, message: MapMessage, grid: OccupancyGrid, settings: LiveSettings
) -> str:
    """Explain why a map has a new frame; empty if it has the old one."""
    if message.frame != last.frame:
        return f"restarted: its frame is {message.frame}, no longer {last.frame}"
    kept = kept_share(before, grid, settings.compared_cells)
    if kept < settings.kept_share:
        return f"restarted: its map keeps {100.0 * kept:.0f} % of the cells before"
    return ""
