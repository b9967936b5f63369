"""Scan matching: the likelihood of a scan at a pose in a map, and hill climbing to its maximum.

Sources: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), table 6.3, for the likelihood of endpoints; gmapping's
``ScanMatcher::likelihoodAndScore`` and ``optimize`` for the search of the nearest wall and the hill climbing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.particle.settings import MatchSettings
from mapping.particle.tiles import SUBCELLS, TILE, UNSEEN, ParticleMap
from mapping.robot.scan import LidarScan


class Endpoints(NamedTuple):
    """Beams of a scan in the robot's frame, (B, 4) rows of the endpoint's x and y [m] and the beam's direction, and
    the parameters of their likelihood, as ``MatchSettings`` has them."""

    beams: NDArray[np.float64]
    deviation: float
    outliers: float
    least_hits: float


def endpoints(scan: LidarScan, base_from_lidar: SE2, settings: MatchSettings) -> Endpoints:
    """Return the beams with a return, thinned evenly to the settings' number."""
    angles = scan.angles[scan.returned] + base_from_lidar.yaw
    beams = np.column_stack((base_from_lidar.apply(scan.points()), np.cos(angles), np.sin(angles)))
    every = max(1, math.ceil(len(beams) / settings.most_beams))
    kept = np.ascontiguousarray(beams[::every])
    return Endpoints(kept, settings.deviation, settings.outliers, settings.least_hits)


@njit(cache=True)
def log_likelihood(pose: NDArray[np.float64], scan: Endpoints, grid: ParticleMap) -> float:
    """Return the log-likelihood of a scan at a pose (3,) of the base in a map.

    An endpoint counts by its distance d to the nearest wall cell of the 3 x 3 around it:
    ``log(exp(-d^2 / (2 deviation^2)) + outliers)``. A wall cell is left out if the cell before it on the beam is a
    wall, because the beam would not have reached it.
    """
    c, s = math.cos(pose[2]), math.sin(pose[2])
    scale = 0.5 * (grid.resolution / scan.deviation) ** 2
    total = 0.0
    for k in range(scan.beams.shape[0]):
        end_x, end_y, along_x, along_y = scan.beams[k]
        x = (pose[0] + c * end_x - s * end_y) / grid.resolution - grid.first[1]
        y = (pose[1] + s * end_x + c * end_y) / grid.resolution - grid.first[0]
        col, row = math.floor(x), math.floor(y)
        col_before = math.floor(x - math.sqrt(2.0) * (c * along_x - s * along_y)) - col
        row_before = math.floor(y - math.sqrt(2.0) * (s * along_x + c * along_y)) - row
        nearest = math.inf
        for i in range(row - 1, row + 2):
            for j in range(col - 1, col + 2):
                if not is_wall(grid, i, j, scan.least_hits):
                    continue
                if is_wall(grid, i + row_before, j + col_before, scan.least_hits):
                    continue
                mean = grid.means[grid.table[i // TILE, j // TILE], i % TILE, j % TILE]
                dx, dy = j + mean[0] / SUBCELLS - x, i + mean[1] / SUBCELLS - y
                nearest = min(nearest, dx * dx + dy * dy)
        total += math.log(math.exp(-scale * nearest) + scan.outliers)
    return total


@njit(cache=True)
def is_wall(grid: ParticleMap, row: int, col: int, least_hits: float) -> bool:
    """Return whether more than a share of a cell's visits were hits; cells beyond the map are no walls."""
    if row < 0 or col < 0 or row >= grid.table.shape[0] * TILE or col >= grid.table.shape[1] * TILE:
        return False
    tile = grid.table[row // TILE, col // TILE]
    if tile == UNSEEN:
        return False
    i, j = row % TILE, col % TILE
    hit: bool = grid.hits[tile, i, j] > least_hits * grid.visits[tile, i, j]
    return hit


@njit(cache=True)
def climb(
    pose: NDArray[np.float64], scan: Endpoints, grid: ParticleMap, step: float, turn: float, halvings: int
) -> tuple[NDArray[np.float64], float]:
    """Climb from a pose (3,) to a maximum of the likelihood; return the pose there and its log-likelihood.

    Of the steps forwards, backwards, to the left, to the right, and the turns both ways, take the best as long as one
    improves; then halve ``step`` [m] and ``turn`` [rad].
    """
    best, value = pose.copy(), log_likelihood(pose, scan, grid)
    for _ in range(halvings + 1):
        improved = True
        while improved:
            improved = False
            centre = best
            c, s = step * math.cos(centre[2]), step * math.sin(centre[2])
            ways = ((c, s, 0.0), (-c, -s, 0.0), (-s, c, 0.0), (s, -c, 0.0), (0.0, 0.0, turn), (0.0, 0.0, -turn))
            for way in ways:
                trial = centre + np.array(way)
                there = log_likelihood(trial, scan, grid)
                if there > value:
                    best, value, improved = trial, there, True
        step, turn = step / 2.0, turn / 2.0
    return best, value
