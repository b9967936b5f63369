"""The truth about maps that drift: what fits best, what bends remain, what two robots both saw.

Odometry drift bends a map, so that no transform fits it exactly. The truth is therefore fitted, on where beams were
believed to hit against where they truly hit, one weight a true cell. The scale is never fitted: the disguise fixes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.frame import GridFrame
from mapping.grid import OccupancyGrid
from mapping.identifiability import Identifiability, identifiability
from mapping.log_odds import LogOddsMapper
from mapping.robot_log import RobotLog, RobotTruth
from mapping.scan import LidarScan
from mapping.se2 import SE2
from mapping.similarity2 import Similarity2
from mapping.trajectory import Trajectory

TRUE_RESOLUTION = 0.05
"""Size of a true cell [m]."""

LEAST_COMMON_CELLS = 20
"""Fewer common wall cells (a metre of wall) fix no pair; the pair's truth is then composed of the two maps'."""


@dataclass(frozen=True, eq=False)
class Sightings:
    """True cells (N, 2) row, col of the world where a robot's beams ended, and the mean place of those ends:
    ``true`` (N, 2) in the world [m], ``believed`` (N, 2) in the robot's start frame [m]."""

    cells: NDArray[np.int64]
    true: NDArray[np.float64]
    believed: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", frozen_array(self.cells, np.int64))
        object.__setattr__(self, "true", frozen_array(self.true, np.float64))
        object.__setattr__(self, "believed", frozen_array(self.believed, np.float64))


@dataclass(frozen=True)
class MapTruth:
    """``world_from_map`` fits the map best, ``world_from_start_map`` holds at the robot's start;
    ``distortion`` is what the fit leaves, RMS [m]."""

    world_from_map: Similarity2
    world_from_start_map: Similarity2
    distortion: float


@dataclass(frozen=True)
class PairPlaces:
    """``overlap`` is the share of commonly observed true cells in the smaller footprint; ``identifiability`` says
    whether the two footprints have one right answer."""

    overlap: float
    identifiability: Identifiability

    @staticmethod
    def of(target: OccupancyGrid, source: OccupancyGrid) -> PairPlaces:
        """Compare two footprints of :func:`footprint`, in one world frame."""
        return PairPlaces(overlap(target.known, source.known), identifiability(target, source))


@dataclass(frozen=True)
class PairTruth:
    """``target_from_source`` fitted on ``common_cells`` wall cells that both saw; ``residual`` is what it leaves,
    RMS [m]. ``fitted`` is False where too few are common: it is then composed of the two maps' own fits, and the
    residual is None. ``places`` tells of the footprints, which no noise changes."""

    target_from_source: Similarity2
    fitted: bool
    common_cells: int
    residual: float | None
    places: PairPlaces


def sightings(log: RobotLog, truth: RobotTruth, start_from_base: Trajectory, replaced: NDArray[np.bool_]) -> Sightings:
    """Where beams were believed to end and where they truly ended, averaged over each true cell.

    ``start_from_base`` are the believed poses, one a scan; ``replaced`` (N, B) marks readings that noise made up.
    Those are left out, and so are hits on robots.

    Raises ``ValueError`` where no beam is left.
    """
    world_from_base = truth.trajectory
    believed, true = [], []
    for k, (read, exact) in enumerate(zip(log.scans, truth.scans, strict=True)):
        usable = read.returned & exact.returned & ~replaced[k] & ~truth.hits_robot[k]
        believed.append((start_from_base.pose(k) @ log.base_from_lidar).apply(_beam_points(read, usable)))
        true.append((world_from_base.pose(k) @ truth.base_from_lidar).apply(_beam_points(exact, usable)))
    return _average_by_cell(np.concatenate(true), np.concatenate(believed))


def _beam_points(scan: LidarScan, usable: NDArray[np.bool_]) -> NDArray[np.float64]:
    reach, angles = scan.ranges[usable].astype(np.float64), scan.angles[usable]
    return np.stack((reach * np.cos(angles), reach * np.sin(angles)), axis=-1)


def _average_by_cell(true: NDArray[np.float64], believed: NDArray[np.float64]) -> Sightings:
    if not len(true):
        raise ValueError("sightings: no beam that hit the world is left to fit the truth on")
    cells = np.floor(true[:, ::-1] / TRUE_RESOLUTION).astype(np.int64)
    corner = cells.min(axis=0)
    rows, cols = cells.max(axis=0) - corner + 1
    index = (cells[:, 0] - corner[0]) * cols + (cells[:, 1] - corner[1])
    counts = np.bincount(index, minlength=rows * cols)
    seen = np.flatnonzero(counts)

    def mean(points: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = [np.bincount(index, weights=points[:, axis])[seen] for axis in (0, 1)]
        return np.stack(sums, axis=-1) / counts[seen, None]

    return Sightings(np.stack(np.divmod(seen, cols), axis=-1) + corner, mean(true), mean(believed))


def fit_rigid(source: NDArray[np.float64], target: NDArray[np.float64]) -> SE2:
    """Least-squares ``target_from_source`` of point pairs, both (N, 2) (Umeyama 1991, equations 40 to 42, scale 1).

    One pair alone fixes no rotation: it is then 0. Raises ``ValueError`` without pairs.
    """
    if not len(source):
        raise ValueError("fit_rigid: no pair of points")
    centre_source, centre_target = source.mean(axis=0), target.mean(axis=0)
    a, b = source - centre_source, target - centre_target
    yaw = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    shift = centre_target - SE2(0.0, 0.0, yaw).apply(centre_source)
    return SE2(float(shift[0]), float(shift[1]), yaw)


def _rms(moved: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    return math.sqrt(float(((moved - target) ** 2).sum(axis=1).mean()))


def map_truth(seen: Sightings, world_from_start: SE2, start_from_map: Similarity2) -> MapTruth:
    """Where the map truly lies: best fit, and as the robot's start has it."""
    best = fit_rigid(seen.believed, seen.true)
    return MapTruth(
        world_from_map=Similarity2.from_se2(best) @ start_from_map,
        world_from_start_map=Similarity2.from_se2(world_from_start) @ start_from_map,
        distortion=_rms(best.apply(seen.believed), seen.true),
    )


def common_rows(a: Sightings, b: Sightings) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of a and of b that tell of the same true cells, (N,) each."""
    both = np.concatenate((a.cells, b.cells))
    low = both.min(axis=0)
    width = int(np.ptp(both[:, 1])) + 1
    key_a, key_b = ((cells - low) @ np.array([width, 1]) for cells in (a.cells, b.cells))
    _, rows_a, rows_b = np.intersect1d(key_a, key_b, assume_unique=True, return_indices=True)
    return rows_a, rows_b


def pair_truth(
    target: Sightings,
    source: Sightings,
    target_start_from_map: Similarity2,
    source_start_from_map: Similarity2,
    places: PairPlaces,
) -> PairTruth:
    """What takes the source map to the target map where both saw the same walls."""
    rows_t, rows_s = common_rows(target, source)
    fitted = len(rows_t) >= LEAST_COMMON_CELLS
    if fitted:
        start_from_start = fit_rigid(source.believed[rows_s], target.believed[rows_t])
        residual = _rms(start_from_start.apply(source.believed[rows_s]), target.believed[rows_t])
    else:
        start_from_start = fit_rigid(target.believed, target.true).inverse() @ fit_rigid(source.believed, source.true)
        residual = None
    return PairTruth(
        target_start_from_map.inverse() @ Similarity2.from_se2(start_from_start) @ source_start_from_map,
        fitted,
        len(rows_t),
        residual,
        places,
    )


def observed(truth: RobotTruth, world: GridFrame, clear_range: float = 0.0) -> NDArray[np.bool_]:
    """Which cells of the world's raster the robot's true beams crossed or ended in: (rows, cols).

    The raster's cells must be aligned with the world's origin, as those of the true raster are.
    """
    mapper = LogOddsMapper(world.resolution, clear_range=clear_range)
    for k, scan in enumerate(truth.scans):
        mapper.integrate(scan, truth.trajectory.pose(k) @ truth.base_from_lidar)
    return _placed(mapper.grid(), world)


def _placed(grid: OccupancyGrid, world: GridFrame) -> NDArray[np.bool_]:
    seen = np.zeros(world.shape, np.bool_)
    known = np.argwhere(grid.known)
    cells = known + np.rint(
        (np.array([grid.frame.origin.y - world.origin.y, grid.frame.origin.x - world.origin.x])) / world.resolution
    ).astype(np.int64)
    inside = cells[world.contains(cells)]
    seen[inside[:, 0], inside[:, 1]] = True
    return seen


def footprint(world: OccupancyGrid, seen: NDArray[np.bool_]) -> OccupancyGrid:
    """The true raster of what a robot could have seen: the world's where it looked, unknown elsewhere."""
    return OccupancyGrid(world.frame, np.where(seen, world.log_odds, np.float32(0.0)))


def overlap(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """Commonly observed cells over those of the smaller footprint: 0 to 1."""
    smaller = min(int(a.sum()), int(b.sum()))
    return int((a & b).sum()) / smaller if smaller else 0.0
