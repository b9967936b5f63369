"""Tiled maps equal a dense grid, and a particle's map changes by its own scans only."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.sensor_model import COUNTING
from mapping.particle.filter import particle_grid
from mapping.particle.tiles import COUNT_LIMIT, TILE, TiledMaps
from mapping.robot.scan import LidarScan

STEP = math.tau / 40


def random_scan(rng: np.random.Generator) -> LidarScan:
    ranges = rng.uniform(0.2, 8.0, 40).astype(np.float32)
    ranges[rng.random(40) < 0.2] = np.inf
    return LidarScan(0.0, -math.pi, STEP, 0.1, 8.0, ranges)


def random_pose(rng: np.random.Generator) -> SE2:
    return SE2(*rng.uniform(-15.0, 15.0, 2), rng.uniform(-3.0, 3.0))


def one_beam(distance: float) -> LidarScan:
    return LidarScan(0.0, 0.0, 0.1, 0.1, 50.0, np.array([distance], np.float32))


@pytest.mark.parametrize("clear_range", [0.0, 3.0])
def test_each_map_equals_the_dense_grid_of_its_own_scans(clear_range: float) -> None:
    """The oracle maps each particle's scans, those of its ancestors included, in one array."""
    rng = np.random.default_rng(3)
    count = 4
    maps = TiledMaps(count, 0.1)
    seen: list[list[tuple[LidarScan, SE2]]] = [[] for _ in range(count)]
    for _ in range(12):
        for particle in range(count):
            scan, pose = random_scan(rng), random_pose(rng)
            maps.integrate(particle, scan, pose, clear_range)
            seen[particle].append((scan, pose))
        ancestors = rng.integers(0, count, count)
        maps.resample(ancestors)
        seen = [list(seen[ancestor]) for ancestor in ancestors]
    for particle, scans in enumerate(seen):
        dense = LogOddsMapper(0.1, COUNTING, clear_range)
        for scan, pose in scans:
            dense.integrate(scan, pose)
        expected, grid = dense.grid(), particle_grid(maps, particle)
        assert grid.frame.shape == expected.frame.shape
        assert grid.frame.origin.x == pytest.approx(expected.frame.origin.x)
        assert grid.frame.origin.y == pytest.approx(expected.frame.origin.y)
        assert np.array_equal(grid.log_odds, expected.log_odds)


def contents(maps: TiledMaps, particle: int) -> tuple[NDArray[np.uint16], ...]:
    table = maps.table[particle]
    held = table[table >= 0]
    return maps.visits[held], maps.hits[held], maps.means[held]


@given(st.lists(st.tuples(st.integers(0, 2), st.booleans()), min_size=1, max_size=12), st.integers(0, 99))
def test_a_scan_never_changes_the_map_of_another_particle(actions: list[tuple[int, bool]], seed: int) -> None:
    rng = np.random.default_rng(seed)
    maps = TiledMaps(3, 0.2)
    for particle, resample in actions:
        before = [contents(maps, other) for other in range(3)]
        maps.integrate(particle, random_scan(rng), random_pose(rng), 0.0)
        for other in {0, 1, 2} - {particle}:
            for was, now in zip(before[other], contents(maps, other), strict=True):
                assert np.array_equal(was, now)
        if resample:
            maps.resample(rng.integers(0, 3, 3))


def test_particles_of_one_ancestor_share_what_neither_has_changed() -> None:
    maps = TiledMaps(2, 0.1)
    maps.integrate(0, one_beam(20.0), SE2(0.05, 0.05), 0.0)
    maps.resample(np.zeros(2, np.int64))
    assert np.array_equal(maps.table[0], maps.table[1])
    maps.integrate(1, one_beam(2.0), SE2(0.05, 0.05), 0.0)
    apart = maps.table[0] != maps.table[1]
    assert apart.sum() == 1 and (maps.table[0] >= 0).sum() == math.ceil(200 / TILE)


def test_tiles_that_no_particle_holds_are_used_again() -> None:
    rng = np.random.default_rng(5)
    maps = TiledMaps(4, 0.1)
    for _ in range(40):
        for particle in range(4):
            maps.integrate(particle, random_scan(rng), SE2(0.0, 0.0, rng.uniform(-3.0, 3.0)), 0.0)
        maps.resample(rng.integers(0, 4, 4))
    assert len(maps.visits) < 2 * 4 * (maps.table[0] >= 0).sum()


def test_the_mean_of_a_cell_is_that_of_the_points_in_it() -> None:
    maps = TiledMaps(1, 1.0)
    points = [2.1, 2.4, 2.9, 2.2]
    for point in points:
        maps.integrate(0, one_beam(point), SE2(0.0, 0.25), 0.0)
    tile = maps.table[0, 0 - int(maps.first[0]) // TILE, 0 - int(maps.first[1]) // TILE]
    assert maps.hits[tile, 0, 2] == maps.visits[tile, 0, 2] == 4
    assert maps.means[tile, 0, 2] / 65535.0 == pytest.approx([np.mean(points) - 2.0, 0.25], abs=1e-4)


def test_a_cell_stops_counting_before_its_number_overflows() -> None:
    maps = TiledMaps(1, 1.0)
    maps.integrate(0, one_beam(2.5), SE2(0.5, 0.5), 0.0)
    tile = maps.table[maps.table >= 0][0]
    maps.visits[tile, 0, 0] = COUNT_LIMIT
    maps.integrate(0, one_beam(2.5), SE2(0.5, 0.5), 0.0)
    assert maps.visits[tile, 0, :4].tolist() == [COUNT_LIMIT, 2, 2, 2]


def test_a_map_that_a_wrong_pose_would_make_huge_is_refused() -> None:
    maps = TiledMaps(2, 0.05)
    maps.integrate(0, one_beam(2.0), SE2(), 0.0)
    with pytest.raises(ValueError, match=r"cells of 0\.05 m, must have at most 400000000"):
        maps.integrate(1, one_beam(2.0), SE2(20_000.0, 20_000.0), 0.0)


@pytest.mark.parametrize(
    ("place", "reach"), [(1e18, 2.0), (2.0**58 * 32 * 0.05, 2.0), (1e300, 2.0), (0.0, 1e29), (0.0, 1e15)]
)
def test_a_scan_far_off_is_refused(place: float, reach: float) -> None:
    """Whole numbers of cells overflowed, and the compiled loops got a table of another size."""
    maps = TiledMaps(1, 0.05)
    near, far = (LidarScan(0.0, -1.0, 0.5, 0.1, 1e30, np.full(4, length, dtype=np.float32)) for length in (2.0, reach))
    maps.integrate(0, near, SE2(), 5.0)
    before = [array.copy() for array in maps.counts(0)]
    with pytest.raises(ValueError, match=r"a scan reaches .* m from the origin"):
        maps.integrate(0, far, SE2(place), 5.0)
    assert all(np.array_equal(*pair) for pair in zip(before, maps.counts(0), strict=True))
