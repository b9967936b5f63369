"""What a beam reads that looks a little beside its direction."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.robot.scan import LidarScan

STEEPEST = 6.0
"""Two readings an angle apart [rad] lie on one surface if they differ by at most this times angle times the shorter:
a wall that the beam meets at 80 degrees from its normal."""


def read_beside(scan: LidarScan, angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The ranges [m] that the beams of a clean scan read ``angles`` [rad] beside their directions, (B,), and which of
    them therefore read something else than their own surface, (B,).

    Between two beams that hit one surface, the beam ends on the straight line through the two hits: exact on a flat
    wall. Across an edge, or beside a beam without a return, it reads what the nearer beam reads: nothing hangs in
    the air between two surfaces. A scan of a full turn has no ends; elsewhere a beam looks no farther than the
    outermost one. An angle of 0 gives the scan's own range, bit for bit.
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
