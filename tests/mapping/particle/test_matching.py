"""The likelihood of a scan by a slow oracle, and hill climbing back to a known pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.particle.matching import Endpoints, climb, endpoints, log_likelihood
from mapping.particle.settings import MatchSettings
from mapping.particle.tiles import SUBCELLS, TILE, TiledMaps
from tests.mapping.particle.room import BASE_FROM_LIDAR, room_log, true_path

RESOLUTION = 0.05
SETTINGS = MatchSettings()


@pytest.fixture(scope="module")
def maps() -> TiledMaps:
    log = room_log(true_path(scans=12))
    maps = TiledMaps(1, RESOLUTION)
    for k, scan in enumerate(log.scans):
        maps.integrate(0, scan, log.odometry.pose(k) @ BASE_FROM_LIDAR, 0.0)
    return maps


def walls_of(maps: TiledMaps, least_hits: float) -> dict[tuple[int, int], tuple[float, float]]:
    """Return the mean point [cells] of each wall cell, by row and col from the map's origin."""
    hits, visits = maps.counts(0)
    found = {}
    for row, col in np.argwhere(hits > least_hits * visits).tolist():
        tile = maps.table[0, row // TILE, col // TILE]
        x, y = maps.means[tile, row % TILE, col % TILE] / SUBCELLS
        cell = (row + int(maps.first[0]), col + int(maps.first[1]))
        found[cell] = (cell[1] + x, cell[0] + y)
    return found


def slow_log_likelihood(pose: SE2, scan: Endpoints, maps: TiledMaps) -> float:
    walls = walls_of(maps, scan.least_hits)
    total = 0.0
    for x, y, dx, dy in scan.beams.tolist():
        (end,), (way,) = pose.apply([(x, y)]) / RESOLUTION, SE2(yaw=pose.yaw).apply([(dx, dy)])
        row, col = math.floor(end[1]), math.floor(end[0])
        before = np.floor(end - math.sqrt(2.0) * way).astype(int) - (col, row)
        distances = [
            math.hypot(walls[i, j][0] - end[0], walls[i, j][1] - end[1])
            for i in range(row - 1, row + 2)
            for j in range(col - 1, col + 2)
            if (i, j) in walls and (i + before[1], j + before[0]) not in walls
        ]
        distance = RESOLUTION * min(distances, default=math.inf)
        total += math.log(math.exp(-0.5 * (distance / scan.deviation) ** 2) + scan.outliers)
    return total


def test_the_likelihood_equals_the_slow_reference(maps: TiledMaps) -> None:
    rng = np.random.default_rng(4)
    true = true_path(scans=12)
    for k, scan in enumerate(room_log(true).scans):
        x, y, yaw = true.poses[k] + rng.uniform(-0.1, 0.1, 3)
        compared = endpoints(scan, BASE_FROM_LIDAR, SETTINGS)
        fast = log_likelihood(np.array([x, y, yaw]), compared, maps.map(0))
        assert fast == pytest.approx(slow_log_likelihood(SE2(x, y, yaw), compared, maps), abs=1e-9)


def test_no_endpoint_on_a_wall_has_the_outliers_likelihood(maps: TiledMaps) -> None:
    scan = endpoints(room_log(true_path(scans=12)).scans[0], BASE_FROM_LIDAR, SETTINGS)
    far = log_likelihood(np.array([500.0, 0.0, 0.0]), scan, maps.map(0))
    assert far == pytest.approx(len(scan.beams) * math.log(SETTINGS.outliers))


@pytest.mark.parametrize("off", [(0.08, -0.05, 0.03), (-0.06, 0.07, -0.05), (0.0, 0.0, 0.0)])
def test_climbing_finds_the_true_pose(maps: TiledMaps, off: tuple[float, float, float]) -> None:
    true = true_path(scans=12)
    scan = endpoints(room_log(true).scans[5], BASE_FROM_LIDAR, SETTINGS)
    start = true.poses[5] + off
    pose, value = climb(start, scan, maps.map(0), 0.05, 0.05, 5)
    assert pose == pytest.approx(true.poses[5], abs=0.012)
    assert value == log_likelihood(pose, scan, maps.map(0)) >= log_likelihood(start, scan, maps.map(0))


def test_beams_are_thinned_evenly_to_the_settings_number() -> None:
    scan = room_log(true_path(scans=3)).scans[0]
    assert len(endpoints(scan, SE2(), MatchSettings(most_beams=120)).beams) == 120
    assert len(endpoints(scan, SE2(), MatchSettings(most_beams=179)).beams) == 120
    assert np.array_equal(endpoints(scan, SE2(), MatchSettings(most_beams=360)).beams[:, :2], scan.points())
