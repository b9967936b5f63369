"""Synthetic teams without a mission: scans from a few places of a world, mapped at poses that drift."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.graph import MCP_Geometric

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import fit_rigid
from mapping.map_set import MapSet, Unit
from mapping.robot.scan import LidarScan
from sim.physics.bodies import RAY_HEIGHT
from sim.physics.bullet import MAX_RAYS, BulletScene
from worlds.raster import true_raster
from worlds.world import World

COARSE = 0.25
"""Cell size of the raster for path planning [m]."""

CLEARANCE = 2
"""Distance that robots keep from walls [coarse cells]."""

NEAREST, FARTHEST = 0.4, 0.9
"""Distance of a start to the nearest earlier one, as shares of the reach."""


@dataclass(frozen=True)
class DrawnSettings:
    """Settings of a synthetic team.

    Each of the ``maps`` robots scans ``stops`` times within ``reach`` [m] of travel from its start, which is within
    reach of another start. The estimated pose drifts by ``drift`` [m per root metre] and ``turn_drift`` [rad per root
    metre]. The lidar has so many ``beams``, a ``range`` [m] and a standard deviation ``range_noise`` [m]. Maps have
    cells of ``resolution`` [m], stated ``scale_low`` to ``scale_high`` times too small.
    """

    maps: int = 6
    stops: int = 25
    reach: float = 6.0
    drift: float = 0.01
    turn_drift: float = 0.002
    range_noise: float = 0.01
    beams: int = 360
    range: float = 6.0
    resolution: float = 0.05
    scale_low: float = 1.0
    scale_high: float = 1.0


@dataclass(frozen=True, eq=False)
class DrawnTeam:
    """Maps, and the ``world_from_map`` of each: best rigid fit and stated scale."""

    maps: MapSet
    world_from_map: tuple[Similarity2, ...]

    def truth(self, target: int, source: int) -> Similarity2:
        """Return target_from_source, composed of the fits of the whole maps."""
        return self.world_from_map[target].inverse() @ self.world_from_map[source]


def draw_team(world: World, settings: DrawnSettings, rng: np.random.Generator) -> DrawnTeam:
    """Draw a team's maps of a world. The same generator gives the same team."""
    free = _floor(true_raster(world, COARSE))
    nearest = np.full(free.shape, np.inf)
    grids, truths = [], []
    with BulletScene(world, []) as scene:
        for _ in range(settings.maps):
            travel, start = _start(free, nearest, settings, rng)
            nearest = np.minimum(nearest, travel)
            grid, truth = _draw_map(scene, travel, start, settings, rng)
            grids.append(grid)
            truths.append(truth)
    unit: Unit = "m"
    units = (unit,) * settings.maps
    names = tuple(f"map_{index}" for index in range(settings.maps))
    trusted = settings.scale_low == settings.scale_high == 1.0
    return DrawnTeam(MapSet(names, tuple(grids), units, trusted), tuple(truths))


def _floor(raster: OccupancyGrid) -> NDArray[np.bool_]:
    """Mark the coarse cells where a robot can stand, in the largest connected part."""
    clear = ndimage.distance_transform_edt(~raster.occupied) > CLEARANCE
    labels, number = ndimage.label(clear)
    sizes = ndimage.sum_labels(clear, labels, range(1, number + 1))
    largest: NDArray[np.bool_] = labels == 1 + int(np.argmax(sizes))
    return largest


def _start(
    free: NDArray[np.bool_], nearest: NDArray[np.float64], settings: DrawnSettings, rng: np.random.Generator
) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Draw a start; return the travel distance of each coarse cell from it [m], and its cell.

    ``nearest`` is the travel distance to the nearest earlier start, infinite before the first.
    """
    there = (nearest > NEAREST * settings.reach) & (nearest < FARTHEST * settings.reach)
    cells = np.argwhere(there if there.any() else free)
    row, col = cells[int(rng.integers(len(cells)))].tolist()
    return _travel(free, (row, col), settings.reach), (row, col)


def _travel(free: NDArray[np.bool_], start: tuple[int, int], reach: float) -> NDArray[np.float64]:
    """Return the travel distance of each coarse cell within ``reach`` [m]; farther cells are infinitely far.

    Only the cells around the start take part, so that the size of the building costs no time.
    """
    around = math.ceil(reach / COARSE) + 1
    low = [max(0, place - around) for place in start]
    box = tuple(slice(first, place + around + 1) for first, place in zip(low, start, strict=True))
    search = MCP_Geometric(np.where(free[box], 1.0, -1.0), fully_connected=True)
    costs, _ = search.find_costs([tuple(place - first for first, place in zip(low, start, strict=True))])
    travel = np.full(free.shape, np.inf)
    travel[box] = np.where(costs * COARSE <= reach, costs * COARSE, np.inf)
    return travel


def _draw_map(
    scene: BulletScene,
    travel: NDArray[np.float64],
    start: tuple[int, int],
    settings: DrawnSettings,
    rng: np.random.Generator,
) -> tuple[OccupancyGrid, Similarity2]:
    stops = _stops(travel, start, settings, rng)
    moved = np.hypot(*np.diff(stops, axis=0, prepend=stops[:1]).T)
    yaws = np.cumsum(settings.turn_drift * np.sqrt(moved) * rng.standard_normal(len(stops)))
    steps = np.diff(stops, axis=0, prepend=stops[:1])
    turned = np.stack(
        (
            np.cos(yaws) * steps[:, 0] - np.sin(yaws) * steps[:, 1],
            np.sin(yaws) * steps[:, 0] + np.cos(yaws) * steps[:, 1],
        ),
        axis=-1,
    )
    drift = np.cumsum(settings.drift * np.sqrt(moved)[:, None] * rng.standard_normal((len(stops), 2)), axis=0)
    estimated = np.cumsum(turned, axis=0) + drift
    scale = math.exp(rng.uniform(math.log(settings.scale_low), math.log(settings.scale_high)))
    map_from_start = Similarity2(
        rng.uniform(-10.0, 10.0), rng.uniform(-10.0, 10.0), rng.uniform(-math.pi, math.pi), 1.0 / scale
    )
    mapper = LogOddsMapper(settings.resolution / scale)
    hits: list[NDArray[np.float64]] = []
    trues: list[NDArray[np.float64]] = []
    for place, yaw, (x, y) in zip(stops, yaws.tolist(), estimated.tolist(), strict=True):
        scan = _scan(scene, place, settings, rng)
        ranges = np.where(np.isfinite(scan), scan / scale, np.inf).astype(np.float32)
        pose = map_from_start @ Similarity2(x, y, yaw)
        reach = settings.range / scale * 1.01
        look = LidarScan(0.0, -math.pi, math.tau / settings.beams, 0.0, reach, ranges)
        mapper.integrate(look, SE2(pose.x, pose.y, pose.yaw))
        ends = _ends(scan)
        hits.append(Similarity2(x, y, yaw).apply(ends))
        trues.append(place + ends)
    world_from_start = fit_rigid(np.concatenate(hits), np.concatenate(trues))
    return mapper.grid(), Similarity2.from_se2(world_from_start) @ map_from_start.inverse()


def _ends(ranges: NDArray[np.float64]) -> NDArray[np.float64]:
    angles = -math.pi + math.tau / len(ranges) * np.arange(len(ranges))
    hit = np.isfinite(ranges)
    reach, directions = ranges[hit], angles[hit]
    return np.stack((reach * np.cos(directions), reach * np.sin(directions)), axis=-1)


def _stops(
    travel: NDArray[np.float64], start: tuple[int, int], settings: DrawnSettings, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw places (N, 2) [m] within reach, each the nearest to the one before."""
    cells = np.argwhere(travel <= settings.reach)
    left = (cells[rng.permutation(len(cells))[: settings.stops - 1]][:, ::-1] + 0.5) * COARSE
    way = [(np.array(start[::-1]) + 0.5) * COARSE]
    while len(left):
        nearest = int(np.hypot(*(left - way[-1]).T).argmin())
        way.append(left[nearest])
        left = np.delete(left, nearest, axis=0)
    return np.array(way)


def _scan(
    scene: BulletScene, place: NDArray[np.float64], settings: DrawnSettings, rng: np.random.Generator
) -> NDArray[np.float64]:
    angles = -math.pi + math.tau / settings.beams * np.arange(settings.beams)
    directions = np.stack((np.cos(angles), np.sin(angles), np.zeros(angles.size)), axis=-1)
    origin = np.repeat([[place[0], place[1], RAY_HEIGHT]], angles.size, axis=0)
    hits = scene.rays(origin[:MAX_RAYS], (origin + settings.range * directions)[:MAX_RAYS])
    shares = np.array([hit[2] if hit[0] >= 0 else 1.0 for hit in hits])
    noisy = settings.range * shares + settings.range_noise * rng.standard_normal(angles.size)
    return np.where(shares < 1.0, np.clip(noisy, 0.0, settings.range), np.inf)
