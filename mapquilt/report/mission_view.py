"""Data of the 3-D view of a mission: walls as triangles, and poses and scans of each robot at common times."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.robot.robot_log import RobotTruth
from mapquilt.viz.palette import robot_colour
from sim.mission.mission import Mission
from worlds.polygon import Polygon

MOST_READINGS = 400_000
"""Readings of all robots together that are embedded, at 2 bytes each."""
MOST_FRAMES = 600
MOST_BEAMS = 180
NO_RETURN = 0
MILLIMETRES = 1000.0


def mission_view(mission: Mission) -> dict[str, Any]:
    """Build the data that ``mission.js`` draws; lengths in metres, angles in radians, times in seconds.

    Times and beams are thinned evenly, so that the page stays small. ``ranges`` are little-endian uint16 in
    millimetres, by frame and beam, 0 without a return, in base64; ``frames`` holds x, y, yaw of each frame.
    """
    ends = [truth.trajectory.stamps[-1] for truth in mission.robots]
    beams = [min(MOST_BEAMS, truth.scans[0].ranges.size) for truth in mission.robots]
    scans = max(len(truth.scans) for truth in mission.robots)
    frames = max(2, min(MOST_FRAMES, scans, MOST_READINGS // sum(beams)))
    times = np.linspace(0.0, float(max(ends)), frames)
    return {
        "size": list(mission.world.size),
        "walls": [_wall(polygon) for polygon in mission.world.obstacles],
        "times": [round(float(time), 3) for time in times],
        "robots": [
            _robot(index, truth, mission.settings.robots[index].radius, times, beams[index])
            for index, truth in enumerate(mission.robots)
        ],
    }


def _wall(polygon: Polygon) -> dict[str, list[Any]]:
    """Return the corners of a solid, and the triangles of its top."""
    return {"corners": np.round(polygon, 3).ravel().tolist(), "triangles": triangles(polygon).ravel().tolist()}


def triangles(polygon: Polygon) -> NDArray[np.intp]:
    """Cut a simple counter-clockwise polygon (N, 2) into triangles (N - 2, 3) of its corners, by clipping ears.

    Source: Meisters 1975, "Polygons have ears".
    """
    left, found = list(range(len(polygon))), []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(polygon, left, k)), 0)
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    return np.array([*found, tuple(left)], np.intp)


def _is_ear(polygon: Polygon, left: list[int], k: int) -> bool:
    corners = left[k - 1], left[k], left[(k + 1) % len(left)]
    a, b, c = (polygon[corner] for corner in corners)
    if _cross(a, b, c) <= 0.0:
        return False
    others = polygon[[corner for corner in left if corner not in corners]]
    inside = (_cross(a, b, others) >= 0.0) & (_cross(b, c, others) >= 0.0) & (_cross(c, a, others) >= 0.0)
    return not bool(inside.any())


def _cross(a: NDArray[np.float64], b: NDArray[np.float64], points: NDArray[np.float64]) -> Any:
    """Return twice the signed area of the triangle a, b and each point."""
    return (b[0] - a[0]) * (points[..., 1] - a[1]) - (b[1] - a[1]) * (points[..., 0] - a[0])


def _robot(index: int, truth: RobotTruth, radius: float, times: NDArray[np.float64], beams: int) -> dict[str, Any]:
    stamps, scan = truth.trajectory.stamps, truth.scans[0]
    at = np.clip(np.searchsorted(stamps, times + 1e-9, side="right") - 1, 0, len(stamps) - 1)
    kept = np.floor(np.arange(beams) * scan.ranges.size / beams).astype(int)
    readings = np.array([truth.scans[k].ranges[kept] for k in at.tolist()])
    seen = np.isfinite(readings) & ~truth.hits_robot[at][:, kept]
    limit = float(np.iinfo(np.uint16).max)
    ranges = np.where(seen, np.clip(np.rint(MILLIMETRES * np.where(seen, readings, 0.0)), 1.0, limit), NO_RETURN)
    mount = truth.base_from_lidar
    return {
        "name": f"robot {index}",
        "colour": robot_colour(index),
        "radius": radius,
        "mount": [mount.x, mount.y, mount.yaw],
        "angles": np.round(scan.angle_min + kept * scan.angle_increment, 5).tolist(),
        "frames": np.round(truth.trajectory.poses[at], 3).ravel().tolist(),
        "ranges": base64.b64encode(ranges.astype("<u2").tobytes()).decode(),
    }
