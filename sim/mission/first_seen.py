"""Find the scan in which a robot first saw each cell of the world."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.grid.traversal import SKIP, beam_ends, draw_scan
from mapping.robot.robot_log import RobotTruth

NEVER = np.iinfo(np.int32).max
_ROUNDING = 4
"""Extra cells around the raster for hits that rounding moves outside."""


def first_seen(truth: RobotTruth, frame: GridFrame, clear_range: float = 0.0) -> NDArray[np.int32]:
    """Return for each cell (rows, cols) the number of the scan, from 1, that first saw it, ``NEVER`` for unseen cells.

    A cell is seen if a true beam crosses it or ends in it, as in ``observed``. A beam without a return crosses cells up
    to ``clear_range`` [m]. The cells of ``frame`` must be aligned with the world's origin.

    Raises ``ValueError`` with the scan if a lidar or a hit lies outside of them.
    """
    # Drawn backwards, so that the number of the scan that touched a cell last is that of the one that saw it first.
    rows, cols = frame.shape
    edge = _ROUNDING + math.ceil(min(clear_range, truth.scans[0].range_max) / frame.resolution)
    total = np.zeros((rows + 2 * edge, cols + 2 * edge), np.float32)
    last = np.zeros(total.shape, np.int32)
    unused, steps = np.zeros((1, 1), np.int32), (np.float32(0.0),) * 4
    corner = np.array((frame.origin.x, frame.origin.y)) / frame.resolution - edge
    for number in range(len(truth.scans), 0, -1):
        scan, pose = truth.scans[number - 1], truth.trajectory.pose(number - 1) @ truth.base_from_lidar
        ends, says = beam_ends(
            scan.ranges,
            scan.angle_min,
            scan.angle_increment,
            pose.x,
            pose.y,
            pose.yaw,
            min(clear_range, scan.range_max),
            frame.resolution,
        )
        if (says == SKIP).all():
            continue
        start = np.array((pose.x, pose.y)) / frame.resolution - corner
        ends -= corner
        draw_scan(total, unused, last, np.int32(number), start[0], start[1], ends, says, *steps, False)
    seen = last[edge : edge + rows, edge : edge + cols]
    return np.where(seen > 0, seen, np.int32(NEVER))
