"""Registration of a scan to surfels by Gauss-Newton with a prior."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.slam.linear_algebra import inverse, product
from mapping.slam.settings import MatchSettings
from mapping.slam.tracking.points import ScanPoints
from mapping.slam.tracking.surfels import SAME_SURFACE, SurfelMap


@dataclass(frozen=True, eq=False)
class Match:
    """Pose x, y [m], yaw [rad] (3,) of a scan in the map's frame.

    ``information`` (3, 3) of the scan alone and ``prior`` (3, 3) that of the prediction; ``share`` of the points that
    found a surfel, ``chi_squared`` their mean squared distance in standard deviations.
    """

    pose: NDArray[np.float64]
    information: NDArray[np.float64]
    prior: NDArray[np.float64]
    share: float
    chi_squared: float

    def covariance(self) -> NDArray[np.float64]:
        """Return the covariance (3, 3) of scan and prediction together."""
        return inverse(self.information + self.prior)


def match_scan(
    scan: ScanPoints,
    surfels: SurfelMap | None,
    guess: NDArray[np.float64],
    prediction: tuple[NDArray[np.float64], NDArray[np.float64]],
    settings: MatchSettings,
) -> Match:
    """Find the pose at which a scan's points lie on the surfels, as near to the prediction as its information asks.

    ``prediction`` is a pose (3,) and its information (3, 3) in the additive x, y, yaw of the map's frame. Each point
    pulls to the nearest surfel of its own side within reach; weights are those of Geman and McClure (1985). Without
    points or surfels, the prediction is the pose.
    """
    mean, prior = prediction
    if surfels is None or len(scan.points) == 0:
        return Match(mean, np.zeros((3, 3)), prior, 0.0, 0.0)
    pose, information, share, chi = register_points(
        scan.points,
        scan.normals,
        scan.deviations,
        surfels,
        guess,
        mean,
        prior,
        settings.iterations,
        settings.first_reach,
        settings.shrink,
        last_reach(surfels.voxel, settings),
        settings.outlier_deviations,
    )
    return Match(pose, information, prior, share, chi)


def last_reach(voxel: float, settings: MatchSettings) -> float:
    """Return the distance [m] within which a point seeks its surfel in the end."""
    return min(max(settings.reach_voxels * voxel, settings.least_reach), settings.greatest_reach)


@njit(cache=True)
def register_points(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    deviations: NDArray[np.float64],
    surfels: SurfelMap,
    guess: NDArray[np.float64],
    mean: NDArray[np.float64],
    prior: NDArray[np.float64],
    iterations: int,
    first_reach: float,
    shrink: float,
    last_reach: float,
    outlier: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
    """Return pose (3,), information of the points (3, 3), share that found a surfel, and mean squared distance."""
    pose = guess.copy()
    reach = max(first_reach, last_reach)
    information, gradient, found, chi = _normal_equations(points, normals, deviations, surfels, pose, reach, outlier)
    for _ in range(iterations):
        off = pose - mean
        off[2] = math.atan2(math.sin(off[2]), math.cos(off[2]))
        step = -product(inverse(information + prior), gradient + product(prior, off))
        pose += step
        settled = reach == last_reach and abs(step[0]) + abs(step[1]) < 1e-4 and abs(step[2]) < 1e-4
        reach = max(reach * shrink, last_reach)
        information, gradient, found, chi = _normal_equations(
            points, normals, deviations, surfels, pose, reach, outlier
        )
        if settled:
            break
    return pose, information, found / max(points.shape[0], 1), chi / max(found, 1.0)


@njit(cache=True)
def _normal_equations(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    deviations: NDArray[np.float64],
    surfels: SurfelMap,
    pose: NDArray[np.float64],
    reach: float,
    outlier: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
    """Sum the weighted information (3, 3) and gradient (3,) of all points at a pose; count those that found a surfel,
    and sum their squared distances."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    information, gradient = np.zeros((3, 3)), np.zeros(3)
    found, chi = 0.0, 0.0
    for k in range(points.shape[0]):
        rx, ry = c * points[k, 0] - s * points[k, 1], s * points[k, 0] + c * points[k, 1]
        nx, ny = c * normals[k, 0] - s * normals[k, 1], s * normals[k, 0] + c * normals[k, 1]
        surfel = nearest_surfel(surfels, pose[0] + rx, pose[1] + ry, nx, ny, reach)
        if surfel < 0:
            continue
        ex, ey = pose[0] + rx - surfels.means[surfel, 0], pose[1] + ry - surfels.means[surfel, 1]
        noise = deviations[k] ** 2
        if surfels.variances[surfel] > 0.0:
            lx, ly = surfels.normals[surfel]
            weight = 1.0 / (surfels.variances[surfel] + noise)
            xx, xy, yy = weight * lx * lx, weight * lx * ly, weight * ly * ly
        else:
            xx, xy, yy = surfels.information[surfel]
            weight = 1.0 / (1.0 + (xx + yy) * noise)
            xx, xy, yy = weight * xx, weight * xy, weight * yy
        gx, gy = xx * ex + xy * ey, xy * ex + yy * ey
        squared = ex * gx + ey * gy
        found += 1.0
        chi += min(squared, outlier * outlier)
        robust = 1.0 / (1.0 + squared / (outlier * outlier)) ** 2
        # d(point) / d(yaw) = (-ry, rx)
        gradient[0] += robust * gx
        gradient[1] += robust * gy
        gradient[2] += robust * (rx * gy - ry * gx)
        hx, hy = robust * (-ry * xx + rx * xy), robust * (-ry * xy + rx * yy)
        information[0, 0] += robust * xx
        information[0, 1] += robust * xy
        information[1, 1] += robust * yy
        information[0, 2] += hx
        information[1, 2] += hy
        information[2, 2] += rx * hy - ry * hx
    information[1, 0], information[2, 0], information[2, 1] = information[0, 1], information[0, 2], information[1, 2]
    return information, gradient, found, chi


@njit(cache=True)
def nearest_surfel(surfels: SurfelMap, x: float, y: float, nx: float, ny: float, reach: float) -> int:
    """Return the surfel whose mean is nearest and whose normal agrees, -1 if none lies within reach [m]."""
    col, row = (x - surfels.x) / surfels.voxel, (y - surfels.y) / surfels.voxel
    span = reach / surfels.voxel
    best, nearest = reach * reach, -1
    for r in range(max(int(row - span), 0), min(int(row + span) + 1, surfels.rows)):
        for c in range(max(int(col - span), 0), min(int(col + span) + 1, surfels.cols)):
            surfel = surfels.first[r * surfels.cols + c]
            while surfel >= 0:
                agree = nx * surfels.normals[surfel, 0] + ny * surfels.normals[surfel, 1]
                dx, dy = surfels.means[surfel, 0] - x, surfels.means[surfel, 1] - y
                squared = dx * dx + dy * dy
                if squared < best and agree > SAME_SURFACE:
                    best, nearest = squared, surfel
                surfel = surfels.following[surfel]
    return nearest
