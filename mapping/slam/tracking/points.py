"""Scans as points with normals, and the lidar's noise as the log itself shows it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan
from mapping.slam.settings import PointSettings

RANGE_BINS = 5
"""Bins of equal population in which the deviation of ranges is estimated."""

SLOPES = (0.003, 0.05)
"""Bounds of the growth of the deviation with the range."""

REFERENCE_RANGE = 4.0
"""Range [m] at which noise levels are compared: a room's width."""


@dataclass(frozen=True)
class RangeDeviation:
    """Standard deviation of a range r [m]: ``offset + slope r``."""

    offset: float
    slope: float

    def at(self, distance: float) -> float:
        return self.offset + self.slope * distance


@dataclass(frozen=True, eq=False)
class ScanPoints:
    """Points of one scan in the base frame [m]: ``points`` (N, 2), unit ``normals`` (N, 2) towards the lidar, and the
    standard ``deviations`` (N,) of their ranges."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    deviations: NDArray[np.float64]


def range_deviation(scans: tuple[LidarScan, ...], settings: PointSettings) -> RangeDeviation:
    """Estimate the lidar's noise from the second differences of neighbouring ranges, which vanish on smooth walls.

    The median absolute second difference in bins of range gives the deviation there; a line through the bins gives
    its growth with range.
    """
    step = max(1, len(scans) // 200)
    ranges = np.stack([scan.ranges for scan in scans[::step]]).astype(np.float64)
    ranges[~np.isfinite(ranges)] = np.nan
    bend = np.abs(ranges[:, :-2] - 2.0 * ranges[:, 1:-1] + ranges[:, 2:]) / math.sqrt(6.0)
    usable = np.isfinite(bend)
    bend, middle = bend[usable], ranges[:, 1:-1][usable]
    if bend.size < 10 * RANGE_BINS:
        return RangeDeviation(settings.least_deviation, SLOPES[0])
    order = np.argsort(middle, kind="stable")
    centres, deviations = [], []
    for part in np.array_split(order, RANGE_BINS):
        centres.append(float(np.median(middle[part])))
        deviations.append(1.4826 * float(np.median(bend[part])))
    x, y = np.array(centres) - np.mean(centres), np.array(deviations) - np.mean(deviations)
    slope = float((x * y).sum() / (x * x).sum()) if np.ptp(centres) > 0.1 else 0.0
    slope = float(np.clip(slope, *SLOPES))
    offset = float(np.median(np.array(deviations) - slope * np.array(centres)))
    return RangeDeviation(max(offset, settings.least_deviation), slope)


def scan_points(
    scan: LidarScan, base_from_lidar: SE2, deviation: RangeDeviation, settings: PointSettings
) -> ScanPoints:
    """Compute the points of a scan that lie on a surface, with the normals of that surface."""
    return ScanPoints(
        *_scan_points(
            scan.ranges,
            scan.angle_min,
            scan.angle_increment,
            np.array([base_from_lidar.x, base_from_lidar.y, base_from_lidar.yaw]),
            deviation.offset,
            deviation.slope,
            settings.neighbours,
            settings.most_neighbours,
            settings.normal_error,
            settings.jump_beams,
        )
    )


@njit(cache=True)
def _scan_points(
    ranges: NDArray[np.float32],
    angle_min: float,
    angle_increment: float,
    mount: NDArray[np.float64],
    offset: float,
    slope: float,
    fewest: int,
    most: int,
    normal_error: float,
    jump_beams: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    beams = ranges.size
    step = abs(angle_increment)
    full = step * (beams + 0.5) > math.tau
    ends = np.empty((beams, 2))
    for k in range(beams):
        angle = mount[2] + angle_min + k * angle_increment
        reach = float(ranges[k]) if math.isfinite(ranges[k]) else 0.0
        ends[k, 0] = mount[0] + reach * math.cos(angle)
        ends[k, 1] = mount[1] + reach * math.sin(angle)
    points, normals, deviations = np.empty((beams, 2)), np.empty((beams, 2)), np.empty(beams)
    count = 0
    for k in range(beams):
        reach = float(ranges[k])
        if not math.isfinite(reach) or reach <= 0.0:
            continue
        sigma = offset + slope * reach
        wanted = (sigma / (normal_error * 0.816 * step * reach)) ** (2.0 / 3.0)
        half = int(min(max(math.ceil(wanted), fewest), most))
        number, sx, sy, sxx, sxy, syy = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for side in (-1, 1):
            last = reach
            for j in range(1, half + 1):
                other = k + side * j
                if other < 0 or other >= beams:
                    if not full:
                        break
                    other %= beams
                near = float(ranges[other])
                limit = 4.2 * sigma + jump_beams * step * min(near, last)
                if not math.isfinite(near) or abs(near - last) > limit:
                    break
                last = near
                dx, dy = ends[other, 0] - ends[k, 0], ends[other, 1] - ends[k, 1]
                number += 1.0
                sx, sy = sx + dx, sy + dy
                sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
        if number < fewest + 1:
            continue
        sxx, sxy, syy = sxx - sx * sx / number, sxy - sx * sy / number, syy - sy * sy / number
        along = 0.5 * math.atan2(2.0 * sxy, sxx - syy)
        nx, ny = -math.sin(along), math.cos(along)
        if nx * (mount[0] - ends[k, 0]) + ny * (mount[1] - ends[k, 1]) < 0.0:
            nx, ny = -nx, -ny
        points[count], deviations[count] = ends[k], sigma
        normals[count, 0], normals[count, 1] = nx, ny
        count += 1
    return points[:count].copy(), normals[:count].copy(), deviations[:count].copy()
