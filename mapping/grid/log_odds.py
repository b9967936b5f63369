"""Occupancy grid mapping with known poses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import SMALLEST_MISS, OccupancyGrid
from mapping.grid.sensor_model import OCTOMAP, CountingModel, LogOddsModel, SensorModel, logit
from mapping.grid.traversal import SKIP, beam_ends, draw_scan, scan_extent
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

COUNTING_LIMIT = 7.0
"""Log-odds of a cell with only hits or only misses, whose logarithm is infinite."""

GROWTH_CELLS = 64
"""The array grows by at least this number of cells, so that it does not grow at every scan."""

MAX_CELLS = 400_000_000
"""A map of more cells (1 km x 1 km at 5 cm) has a wrong pose or unit."""


class LogOddsMapper:
    """Build a grid scan by scan; the grid grows as the robot moves.

    Within a scan each cell counts once, and a hit wins over a miss. Beams without a return (+inf) clear the cells up to
    ``clear_range`` [m], never beyond the lidar's range. The default of 0 clears nothing: a lost echo looks like open
    space and would draw free rays through walls.

    Cells are aligned with the map frame's axes: cell borders lie at whole multiples of ``resolution`` [m].
    """

    def __init__(self, resolution: float = 0.05, model: SensorModel = OCTOMAP, clear_range: float = 0.0) -> None:
        if not (math.isfinite(resolution) and resolution > 0.0):
            raise ValueError(f"LogOddsMapper: resolution is {resolution}, must be positive and finite")
        if not clear_range >= 0.0:
            raise ValueError(f"LogOddsMapper: clear_range is {clear_range}, must be at least 0")
        self.resolution = resolution
        self.model = model
        self.clear_range = clear_range
        self._first_cell = np.zeros(2, np.int64)  # row, col of the array's first cell, counted from the map's origin
        self._scans = 0
        self._allocate((1, 1))

    def _allocate(self, shape: tuple[int, int]) -> None:
        counting = isinstance(self.model, CountingModel)
        self._total = np.zeros(shape, np.float32)
        self._visits = np.zeros(shape if counting else (1, 1), np.int32)
        self._last_scan = np.zeros(shape, np.int32)

    def integrate(self, scan: LidarScan, map_from_lidar: SE2) -> None:
        """Add one scan taken at a pose.

        Raises ``ValueError`` if the map would get more than 400 million cells.
        """
        ends, kinds = beam_ends(
            scan.ranges,
            scan.angle_min,
            scan.angle_increment,
            map_from_lidar.x,
            map_from_lidar.y,
            map_from_lidar.yaw,
            min(self.clear_range, scan.range_max),
            self.resolution,
        )
        if (kinds == SKIP).all():
            return
        start = np.array([map_from_lidar.x, map_from_lidar.y]) / self.resolution
        self._grow(*scan_extent(start, ends).astype(np.int64))
        row, col = self._first_cell
        ends -= (col, row)
        self._scans += 1
        hit, miss, low, high = self._steps()
        draw_scan(
            self._total,
            self._visits,
            self._last_scan,
            np.int32(self._scans),
            start[0] - col,
            start[1] - row,
            ends,
            kinds,
            hit,
            miss,
            low,
            high,
            isinstance(self.model, CountingModel),
        )

    def _steps(self) -> tuple[np.float32, np.float32, np.float32, np.float32]:
        if isinstance(self.model, LogOddsModel):
            steps = logit(self.model.hit), logit(self.model.miss), self.model.low, self.model.high
        else:
            steps = 1.0, 0.0, 0.0, math.inf
        hit, miss, low, high = (np.float32(step) for step in steps)
        return hit, miss, low, high

    def _grow(self, lowest: NDArray[np.int64], highest: NDArray[np.int64]) -> None:
        """Make room up to these cells, x and y from the map's origin."""
        low, high = lowest[::-1], highest[::-1] + 1
        first, last = self._first_cell, self._first_cell + self._total.shape
        if self._scans == 0:
            first, last = low, high
        elif (low >= first).all() and (high <= last).all():
            return
        margin = np.maximum(GROWTH_CELLS, (last - first) // 8)
        new_first = np.where(low < first, low - margin, first)
        new_last = np.where(high > last, high + margin, last)
        rows, cols = (int(n) for n in new_last - new_first)
        if rows * cols > MAX_CELLS:
            raise ValueError(
                f"LogOddsMapper: {rows} x {cols} cells of {self.resolution} m, must have at most {MAX_CELLS}"
            )
        old = (self._total, self._visits, self._last_scan)
        old_first, self._first_cell = self._first_cell, new_first
        self._allocate((rows, cols))
        if self._scans > 0:
            self._paste(old, old_first - new_first)

    def _paste(
        self, old: tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]], at: NDArray[np.int64]
    ) -> None:
        rows, cols = old[0].shape
        window = np.s_[at[0] : at[0] + rows, at[1] : at[1] + cols]
        self._total[window] = old[0]
        self._last_scan[window] = old[2]
        if isinstance(self.model, CountingModel):
            self._visits[window] = old[1]

    def grid(self) -> OccupancyGrid:
        """Return the grid so far, cropped to the observed cells.

        Raises ``ValueError`` if no beam measured anything.
        """
        seen = self._last_scan > 0
        rows, cols = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        if rows.size == 0:
            raise ValueError("LogOddsMapper: no beam of any scan measured anything, so there is no map")
        window = np.s_[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        first = self._first_cell + np.array((rows[0], cols[0]))
        log_odds = self._log_odds(window)
        origin = SE2(float(first[1]) * self.resolution, float(first[0]) * self.resolution, 0.0)
        return OccupancyGrid(GridFrame(self.resolution, origin, (log_odds.shape[0], log_odds.shape[1])), log_odds)

    def _log_odds(self, window: tuple[slice, slice]) -> NDArray[np.float32]:
        if isinstance(self.model, CountingModel):
            return counting_log_odds(self._total[window], self._visits[window], self.model)
        log_odds = self._total[window].copy()
        log_odds[(self._last_scan[window] > 0) & (log_odds == 0.0)] = SMALLEST_MISS
        return log_odds


def counting_log_odds(hits: NDArray[Any], visits: NDArray[Any], model: CountingModel) -> NDArray[np.float32]:
    """Return the log-odds (rows, cols) of the share of hits among visits, less those of the model's threshold.

    Cells with fewer than ``min_visits`` are unknown, 0.
    """
    share = hits.astype(np.float64) / np.maximum(visits, 1)
    with np.errstate(divide="ignore"):
        evidence = (np.log(share) - np.log1p(-share)).astype(np.float32) - np.float32(logit(model.threshold))
    log_odds: NDArray[np.float32] = np.clip(evidence, -COUNTING_LIMIT, COUNTING_LIMIT)
    seen = visits >= model.min_visits
    log_odds[~seen] = 0.0
    log_odds[seen & (log_odds == 0.0)] = SMALLEST_MISS
    return log_odds


def map_log(
    log: RobotLog,
    map_from_base: Trajectory,
    resolution: float = 0.05,
    model: SensorModel = OCTOMAP,
    clear_range: float = 0.0,
) -> OccupancyGrid:
    """Map a robot's scans at the given poses, one for each scan.

    Raises ``ValueError`` if the numbers of poses and scans differ, or no beam measured anything.
    """
    if len(map_from_base) != len(log.scans):
        raise ValueError(f"map_log: {len(log.scans)} scans, but {len(map_from_base)} poses")
    mapper = LogOddsMapper(resolution, model, clear_range)
    for k, scan in enumerate(log.scans):
        mapper.integrate(scan, map_from_base.pose(k) @ log.base_from_lidar)
    return mapper.grid()
