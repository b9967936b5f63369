"""Missions in the two worlds of the thesis, chosen and cut to an overlap, and their maps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.geometry.se2 import SE2, wrap_angle
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.log_odds import map_log
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.sensor_model import sensor_model
from mapping.particle.filter import particle_filter
from mapping.particle.settings import ParticleSettings
from mapping.robot.robot_log import RobotTruth
from mapping.seeds import Role, stream
from reproductions.chen2021.cases import FLOOR_CASES, FLOOR_MAPS, RANGE_SIGMA, RESOLUTION, Condition, Overlap
from sim.mission.first_seen import NEVER, first_seen
from sim.mission.settings import MissionSettings, PolicyName
from sim.mission.simulation import simulate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar_presets import lidar_preset, with_rate
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense
from worlds.building.floor_plan import Room
from worlds.families.registry import make_world
from worlds.families.thesis_floor import thesis_floor_plan
from worlds.raster import true_raster
from worlds.world import World

Goals = tuple[tuple[float, float], ...]
"""Goals x, y [m] in the order of the visit."""

LIDAR = "thesis"
RATE = 2.5
"""Scan rate [Hz]: at 0.6 m/s, one scan every 0.24 m."""

HALL_DURATION, PATROL_DURATION, FLOOR_DURATION = 120.0, 95.0, 250.0
PATHS = 6
"""Missions from each start: one explores, the others patrol between random goals."""
START_JITTER = 0.3
"""Greatest random shift of a start in the hall in x and y [m]."""
STEP = 5
"""Missions end after a multiple of so many scans."""
HALL_AREA = 280.0
"""Cells of the hall that a robot can see [m^2]: 112,000 of 0.05 m."""
KNOWN_WEIGHT = 0.5
"""Weight of the known share against that of either overlap."""
ROUNDS, CLOSE = 3, 0.03
"""Corrections of an overlap, at most, and the error that needs none."""
PARTICLES = 10
"""Particles where the filter maps: gmapping's 30 take three times as long, and the odometry is exact."""


@dataclass(frozen=True, eq=False)
class DrawnMap:
    """A robot's map, and the pose of its frame, the robot's start, in the world."""

    grid: OccupancyGrid
    world_from_map: SE2


@dataclass(frozen=True, eq=False)
class MapPair:
    first: DrawnMap
    second: DrawnMap
    names: tuple[str, str] = ("first", "second")

    @property
    def truth(self) -> Similarity2:
        """Return the true first_from_second."""
        return Similarity2.from_se2(self.first.world_from_map.inverse() @ self.second.world_from_map)

    @property
    def overlap(self) -> tuple[float, float]:
        """Return the cells that both maps know at the truth, as a share of the second map's and of the first's."""
        first, second = self.first.grid, self.second.grid
        return _shared(second, first, self.truth), _shared(first, second, self.truth.inverse())


def _shared(grid: OccupancyGrid, other: OccupancyGrid, other_from_grid: Similarity2) -> float:
    points = grid.frame.metres_from_cells(np.argwhere(grid.known))
    cells = other.frame.cells_from_metres(other_from_grid.apply(points))
    inside = other.frame.contains(cells)
    return float(np.count_nonzero(other.known[cells[inside, 0], cells[inside, 1]]) / max(len(points), 1))


class Path:
    """A robot's true mission, the time at which it first saw each cell of the world, and the maps made of it."""

    def __init__(self, truth: RobotTruth, frame: GridFrame, seed: int, robot: int) -> None:
        self.truth, self._frame, self._seed, self._robot = truth, frame, seed, robot
        self.ends = np.arange(STEP, len(truth.scans) + 1, STEP)
        self._seen: dict[float, NDArray[np.int64]] = {}
        self._holes: dict[float, NDArray[np.float64]] = {}
        self._drawn: dict[tuple[int, Condition], DrawnMap] = {}

    def seen(self, clear_range: float) -> NDArray[np.int64]:
        """Return for each cell (cells,) the index of the first of ``ends`` by which it was seen, or their number."""
        if clear_range not in self._seen:
            first = first_seen(self.truth, self._frame, clear_range).ravel()
            index = np.searchsorted(self.ends, first)
            index[first == NEVER] = len(self.ends)
            self._seen[clear_range] = index
        return self._seen[clear_range]

    def holes(self, clear_range: float) -> NDArray[np.float64]:
        """Return the unknown share inside the outline of what was seen by each of ``ends``."""
        if clear_range not in self._holes:
            seen = self.seen(clear_range).reshape(self._frame.shape)
            self._holes[clear_range] = np.array([hole_share(seen <= end) for end in range(len(self.ends))])
        return self._holes[clear_range]

    def drawn(self, scans: int, condition: Condition) -> DrawnMap:
        """Map the first scans, with noise in the lidar alone, as a condition says of the second map."""
        making = replace(condition, overlap=None, start=0)
        if (scans, making) not in self._drawn:
            self._drawn[scans, making] = _drawn(self.truth.part(0, scans), making, self._seed, self._robot)
        return self._drawn[scans, making]


def hole_share(known: NDArray[np.bool_]) -> float:
    """Return the unknown cells that known ones enclose as a share of all cells inside the outline."""
    inside = int(ndimage.binary_fill_holes(known).sum())
    return (inside - int(known.sum())) / max(1, inside)


Cuts = list[tuple[Path, int]]
"""Missions, and how many scans of each are mapped."""


@dataclass(frozen=True, eq=False)
class Areas:
    """Areas of two footprints for each pair of ends (ends of the first, ends of the second) [cells]: of either, and of
    what both saw."""

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    common: NDArray[np.int64]

    @staticmethod
    def of(first: Path, second: Path, clear_range: float) -> Areas:
        rows, cols = len(first.ends), len(second.ends)
        index = first.seen(clear_range) * (cols + 1) + second.seen(clear_range)
        joint = np.bincount(index, minlength=(rows + 1) * (cols + 1)).reshape(rows + 1, cols + 1)
        alone = joint.sum(axis=1)[:rows].cumsum()[:, None], joint.sum(axis=0)[:cols].cumsum()[None, :]
        return Areas(*alone, joint[:rows, :cols].cumsum(axis=0).cumsum(axis=1))

    def error(self, wanted: Overlap) -> NDArray[np.float64]:
        """Add the absolute errors of the overlap as a share of the second and of the first map."""
        of_second = np.abs(self.common / np.maximum(self.second, 1) - wanted.of_second)
        of_first = np.abs(self.common / np.maximum(self.first, 1) - wanted.of_first)
        return of_second + of_first


class Hall:
    """Missions of one seed in the hall, and the maps of any condition that are made from them."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.world = make_world("thesis_hall", seed)
        self._rng = stream(seed, Role.STARTS)
        self._frame = true_raster(self.world).frame
        self._paths = {start: tuple(self._missions(start)) for start in (0, 3, 4)}

    def _missions(self, start: int) -> Iterator[Path]:
        own = self.world.starts[start]
        for number in range(PATHS):
            x, y = self._rng.uniform(-START_JITTER, START_JITTER, 2)
            policy: PolicyName = "patrol" if number else "explore"
            robot_start = SE2(own.x + x, own.y + y, own.yaw)
            duration = PATROL_DURATION if number else HALL_DURATION
            truth = _mission(self.world, robot_start, duration, self.seed * PATHS + number, policy)
            yield Path(truth, self._frame, self.seed, robot=min(start, 1))

    def pair(self, condition: Condition) -> MapPair:
        """Make the two maps of a condition; they depend on it and the seed alone.

        Noise and coarse cells make a map know more than its robot saw, so the overlap of the true footprints is
        corrected until that of the maps is as wanted.
        """
        wanted = condition.overlap
        if wanted is None:
            whole = [self._paths[start][0] for start in (0, condition.start)]
            return _pair(condition, [(path, len(path.truth.scans)) for path in whole])
        asked, found = wanted, []
        for _ in range(ROUNDS):
            pair = _pair(condition, self._cut(condition, asked))
            of_second, of_first = pair.overlap
            found.append((max(abs(of_second - wanted.of_second), abs(of_first - wanted.of_first)), pair))
            if found[-1][0] < CLOSE:
                break
            second, first = asked.of_second + wanted.of_second - of_second, asked.of_first + wanted.of_first - of_first
            asked = replace(asked, of_second=min(second, 1.0), of_first=min(first, 1.0))
        return min(found, key=lambda each: each[0])[1]

    def _cut(self, condition: Condition, wanted: Overlap) -> Cuts:
        """Choose a mission from either start, and the ends of both, by the overlap of their footprints."""
        best, chosen = np.inf, Cuts()
        for first, second in product(self._paths[0], self._paths[condition.start]):
            areas = Areas.of(first, second, condition.clear_range)
            known = np.abs(areas.first * self._frame.resolution**2 / HALL_AREA - wanted.known)
            error = areas.error(wanted) + KNOWN_WEIGHT * known
            if wanted.holes is not None:
                error += np.abs(second.holes(condition.clear_range) - wanted.holes)
            if error.min() < best:
                best, ends = error.min(), np.unravel_index(int(error.argmin()), error.shape)
                chosen = [(first, int(first.ends[ends[0]])), (second, int(second.ends[ends[1]]))]
        return chosen


def _pair(condition: Condition, cuts: Cuts) -> MapPair:
    """Map both missions; the first map always has the usual cells and noise."""
    usual = replace(condition, resolution=RESOLUTION, range_sigma=RANGE_SIGMA)
    first, second = (path.drawn(scans, each) for (path, scans), each in zip(cuts, (usual, condition), strict=True))
    return MapPair(first, second)


def floor_maps(seed: int) -> dict[str, DrawnMap]:
    """Build one map per robot of the office floor, by name, cut so that all three pairs overlap as in the thesis.

    The seed draws the building and the start headings, which the thesis does not give.
    """
    world = make_world("thesis_floor", seed)
    frame = true_raster(world).frame
    yaws = stream(seed, Role.STARTS).uniform(-np.pi, np.pi, len(FLOOR_MAPS))
    paths = []
    for robot, goals in enumerate(_rounds(world, seed)):
        own = world.starts[robot]
        start = SE2(own.x, own.y, wrap_angle(float(yaws[robot])))
        paths.append(Path(_mission(world, start, FLOOR_DURATION, seed, "patrol", goals), frame, seed, robot))
    cuts = zip(FLOOR_MAPS, paths, _floor_ends(paths), strict=True)
    return {name: path.drawn(int(path.ends[end]), Condition(None)) for name, path, end in cuts}


def _floor_ends(paths: Sequence[Path]) -> tuple[int, ...]:
    """Find the ends of the three missions for which the overlaps of the pairs are nearest to those of the thesis."""
    total = np.zeros([len(path.ends) for path in paths])
    pairs = ((0, 2), (1, 2), (0, 1))  # as the cases name them
    for case, (first, second) in zip(FLOOR_CASES, pairs, strict=True):
        (other,) = {0, 1, 2} - {first, second}
        total += np.expand_dims(Areas.of(paths[first], paths[second], 0.0).error(case.overlap), other)
    return tuple(int(end) for end in np.unravel_index(int(total.argmin()), total.shape))


def _rounds(world: World, seed: int) -> tuple[Goals, Goals, Goals]:
    """List the rooms that each robot visits: a side wing and then the lower one from that side; and the lower one."""
    plan = thesis_floor_plan(stream(seed, Role.WORLD), *world.size)
    corridor = plan.rooms[0]
    rooms = [room for room in plan.rooms if room.kind == "room"]
    low = [room for room in rooms if room.y0 < corridor.y0]
    left = [room for room in rooms if room not in low and room.x1 < world.size[0] / 2.0]
    right = [room for room in rooms if room not in low and room not in left]
    return (
        _middles([*left[::-1], *low[: len(low) // 2]]),
        _middles([*right[::-1], *low[: len(low) // 2 - 1 : -1]]),
        _middles([*low[len(low) // 2 :: -1], *low[len(low) // 2 + 1 :]]),
    )


def _middles(rooms: Sequence[Room]) -> Goals:
    return tuple(((room.x0 + room.x1) / 2.0, (room.y0 + room.y1) / 2.0) for room in rooms)


def _mission(world: World, start: SE2, duration: float, seed: int, policy: PolicyName, goals: Goals = ()) -> RobotTruth:
    robot = RobotSettings(lidar=with_rate(lidar_preset(LIDAR).lidar, RATE), start=start)
    mission, _ = simulate(world, MissionSettings((robot,), duration, policy=policy, goals=goals), seed)
    return mission.robots[0]


def _drawn(truth: RobotTruth, condition: Condition, seed: int, robot: int) -> DrawnMap:
    noise = replace(lidar_preset(LIDAR).noise, range_sigma=condition.range_sigma)
    log = sense(truth, Noise(noise), seed, robot).log
    if condition.mapper == "particles":
        settings = ParticleSettings(particles=PARTICLES)
        found = particle_filter(log, settings, seed, resolution=condition.resolution, clear_range=condition.clear_range)
        return DrawnMap(found.grid, truth.trajectory.pose(0))
    model = sensor_model("counting" if condition.mapper == "counts" else "octomap")
    grid = map_log(log, truth.trajectory.from_start(), condition.resolution, model, condition.clear_range)
    return DrawnMap(grid, truth.trajectory.pose(0))
