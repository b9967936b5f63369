"""Change the direction of lidar beams slightly."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.robot.scan import LidarScan

STEEPEST = 6.0
"""Two readings at an angle a [rad] to each other lie on one surface if they differ by at most this factor times a times
the shorter one: a wall hit at 80 degrees from its normal."""


def apply_angular_jitter(scan: LidarScan, angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read a clean scan with beam k rotated by ``angles[k]`` [rad], (B,).

    Returns the ranges (B,) [m], and a mask (B,) of the beams that hit another surface than without jitter.

    Between two beams that hit one surface, the rotated beam ends on the straight line through both hits, which is exact
    on a flat wall. Across an edge, or next to a beam without a return, it reads what the nearer beam reads, so that no
    point appears in mid-air. A full-turn scan wraps around; otherwise beams stay within the outermost ones. An angle of
    0 gives the original range, bit for bit.
    """
    own = scan.ranges.astype(np.float64)
    beams, step = own.size, abs(scan.angle_increment)
    if not angles.any():
        return own, np.zeros(beams, dtype=np.bool_)
    place = np.arange(beams) + angles / scan.angle_increment
    if abs(beams * step - math.tau) > step / 2.0:
        place = np.clip(place, 0.0, beams - 1.0)
    low = np.floor(place).astype(np.int64)
    share = place - low
    near, far = own[low % beams], own[(low + 1) % beams]
    between = np.where(share < 0.5, near, far)
    chord = (share > 0.0) & _on_one_surface(near, far, np.full(beams, step))
    inverse = np.sin((1.0 - share[chord]) * step) / near[chord] + np.sin(share[chord] * step) / far[chord]
    between[chord] = math.sin(step) / inverse
    elsewhere = (between != own) & ~_on_one_surface(own, between, np.maximum(np.abs(angles), step))
    return between, elsewhere


def _on_one_surface(a: NDArray[np.float64], b: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.bool_]:
    hit = np.isfinite(a) & np.isfinite(b)
    a, b = np.where(hit, a, 1.0), np.where(hit, b, 1.0)
    return hit & (angle < math.pi / 2.0) & (np.abs(a - b) <= STEEPEST * angle * np.minimum(a, b))
