"""True footprints: what a robot could observe of the world from its true poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame, require_area
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.traversal import SKIP, beam_ends, draw_scan, scan_extent
from mapping.robot.robot_log import RobotTruth

TRUE_RESOLUTION = 0.05
"""Size of a true cell [m]: as fine as the finest maps that the data sets hold."""


def observed(truth: RobotTruth, world: GridFrame, clear_range: float = 0.0) -> NDArray[np.bool_]:
    """Mark the cells (rows, cols) of the world's raster that the robot's true beams crossed or ended in.

    Beams without a return cross the cells within ``clear_range`` [m]. The raster's cells must be aligned with the
    world's origin, as those of the true raster are.

    Raises ``ValueError`` if no beam measured anything, or beams end too far apart for a raster.
    """
    scans = []
    for k, scan in enumerate(truth.scans):
        pose = truth.trajectory.pose(k) @ truth.base_from_lidar
        limits = min(clear_range, scan.range_max), world.resolution
        ends, kinds = beam_ends(scan.ranges, scan.angle_min, scan.angle_increment, pose.x, pose.y, pose.yaw, *limits)
        if (kinds != SKIP).any():
            scans.append((np.array([pose.x, pose.y]) / world.resolution, ends, kinds))
    if not scans:
        raise ValueError("observed: no beam measured anything, so there is no footprint")
    extents = np.array([scan_extent(start, ends) for start, ends, _ in scans])
    low, high = extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)
    require_area("observed", low * world.resolution, high * world.resolution, world.resolution)
    cols, rows = (high - low + 1).astype(np.int64).tolist()
    log_odds, touched = np.zeros((rows, cols), np.float32), np.zeros((rows, cols), np.int32)
    visits, steps = np.zeros((1, 1), np.int32), (np.float32(0.0),) * 4
    for start, ends, kinds in scans:
        x, y = start - low
        draw_scan(log_odds, visits, touched, np.int32(1), x, y, ends - low, kinds, *steps, False)
    return _placed(touched > 0, low[::-1].astype(np.int64), world)


def _placed(seen: NDArray[np.bool_], first: NDArray[np.int64], world: GridFrame) -> NDArray[np.bool_]:
    """Copy a raster, whose first cell is row, col ``first`` from the world's origin, onto the world's raster."""
    origin = np.rint(np.array([world.origin.y, world.origin.x]) / world.resolution).astype(np.int64)
    placed = np.zeros(world.shape, np.bool_)
    low = np.maximum(first - origin, 0)
    high = np.minimum(first - origin + seen.shape, world.shape)
    if (low < high).all():
        at = low - (first - origin)
        placed[low[0] : high[0], low[1] : high[1]] = seen[
            at[0] : at[0] + high[0] - low[0], at[1] : at[1] + high[1] - low[1]
        ]
    return placed


def footprint(world: OccupancyGrid, seen: NDArray[np.bool_]) -> OccupancyGrid:
    """Return the true raster of the observed cells, unknown elsewhere."""
    return OccupancyGrid(world.frame, np.where(seen, world.log_odds, np.float32(0.0)))
