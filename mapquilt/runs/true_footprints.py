"""True footprints of the maps of a mission; noise does not change them, so all samples of the mission share them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.coarse_footprint import CoarseFootprint
from mapping.ground_truth.footprint import TRUE_RESOLUTION, footprint, observed
from mapping.ground_truth.truth import PairOverlap
from mapping.io.map_file import map_files
from mapping.robot.robot_log import RobotTruth
from mapquilt.settings import check_parts
from sim.mission.mission import Mission
from worlds.raster import true_raster


def part_bounds(scans: int, part: int, parts: int) -> tuple[int, int]:
    """Return the first scan of a part and the first of the next, if the scans are cut into ``parts`` equal parts."""
    return scans * part // parts, scans * (part + 1) // parts


class ObservedSlices:
    """Cache the cells that robots observed in parts of a mission, so that no scan is traced twice.

    ``cuts`` are the numbers of equal parts that the mission will be cut into; ``clear_range`` [m] is the range that
    beams without a return clear.
    """

    def __init__(self, mission: Mission, cuts: Iterable[int], clear_range: float = 0.0) -> None:
        self.clear_range = clear_range
        self._robots = mission.robots
        self._cuts = tuple(cuts)
        self._slices: dict[tuple[int, int, int], NDArray[np.bool_]] = {}

    def seen(self, robot: int, start: int, stop: int, world: GridFrame) -> NDArray[np.bool_]:
        """Mark the cells (rows, cols) of the world's raster that a robot observed from scan ``start`` to ``stop - 1``.

        Both must be bounds of parts.
        """
        scans = len(self._robots[robot].scans)
        bounds = {bound for parts in self._cuts for part in range(parts) for bound in part_bounds(scans, part, parts)}
        within = sorted(bound for bound in bounds if start <= bound <= stop)
        seen = np.zeros(world.shape, np.bool_)
        for first, last in pairwise(within):
            seen |= self._slice(robot, first, last, world)
        return seen

    def _slice(self, robot: int, start: int, stop: int, world: GridFrame) -> NDArray[np.bool_]:
        key = (robot, start, stop)
        if key not in self._slices:
            self._slices[key] = observed(self._robots[robot].part(start, stop), world, self.clear_range)
        return self._slices[key]


@dataclass(frozen=True, eq=False)
class TrueMap:
    """Hold the truth behind one map: scans ``start`` to ``stop - 1`` of one robot, and the true raster of the cells
    that they observe."""

    name: str
    robot: int
    start: int
    stop: int
    truth: RobotTruth
    footprint: OccupancyGrid


@dataclass(frozen=True, eq=False)
class TrueFootprints:
    """Hold the true raster of the world, the truth behind each map, and the overlap of each pair (target first)."""

    world: OccupancyGrid
    maps: tuple[TrueMap, ...]
    pairs: dict[tuple[str, str], PairOverlap]

    @cached_property
    def raster_files(self) -> dict[str, dict[str, bytes]]:
        """Return the map files, by name, of the true raster and of each footprint; all samples share them."""
        rasters = {"world": self.world, **{one.name: one.footprint for one in self.maps}}
        return {
            stem: {path.name: data for path, data in map_files(grid, Path(stem), picture="png").items()}
            for stem, grid in rasters.items()
        }

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(one.name for one in self.maps)


def map_names(robots: int, parts: int) -> tuple[str, ...]:
    """Name the maps of a team by robot, and by part if there is more than one."""
    return tuple(
        f"robot_{robot}" if parts == 1 else f"robot_{robot}_part_{part}"
        for robot in range(robots)
        for part in range(parts)
    )


def true_footprints(
    mission: Mission, parts: int = 1, seen: ObservedSlices | None = None, on_step: Callable[[], None] = lambda: None
) -> TrueFootprints:
    """Cut each robot's mission into parts of equal time, and find the footprint of each part.

    ``seen`` caches the observed cells of this mission; its cuts must include ``parts``. ``on_step`` is called after
    each map and each pair. Raises ``ValueError`` if the mission has fewer scans than parts.
    """
    check_parts(parts)
    seen = seen or ObservedSlices(mission, (parts,))
    world = true_raster(mission.world, TRUE_RESOLUTION)
    places = itertools.product(range(len(mission.robots)), range(parts))
    names = map_names(len(mission.robots), parts)
    maps: list[TrueMap] = []
    for name, (robot, part) in zip(names, places, strict=True):
        maps.append(_true_map(name, world, robot, mission.robots[robot], (part, parts), seen))
        on_step()
    coarse = {one.name: CoarseFootprint.of(one.footprint) for one in maps}
    pairs = {}
    for a, b in itertools.combinations(maps, 2):
        pairs[a.name, b.name] = PairOverlap.of(a.footprint, b.footprint, (coarse[a.name], coarse[b.name]))
        on_step()
    return TrueFootprints(world, tuple(maps), pairs)


def _true_map(
    name: str, world: OccupancyGrid, robot: int, truth: RobotTruth, cut_at: tuple[int, int], seen: ObservedSlices
) -> TrueMap:
    (part, parts), scans = cut_at, len(truth.scans)
    if scans < parts:
        raise ValueError(f"parts is {parts}, but robot_{robot} has only {scans} scans")
    start, stop = part_bounds(scans, part, parts)
    shown = footprint(world, seen.seen(robot, start, stop, world.frame))
    return TrueMap(name, robot, start, stop, truth.part(start, stop), shown)
