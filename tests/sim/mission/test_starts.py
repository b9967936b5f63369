"""Start poses of robots."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from sim.mission.starts import random_starts
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World


def test_starts_stand_clear_of_walls_and_of_each_other() -> None:
    for seed in range(5):
        world = make_world("office", seed)
        starts = random_starts(np.random.default_rng(seed), world, 8)
        assert world.clearance([(start.x, start.y) for start in starts]).min() >= 0.5
        assert min(math.dist((a.x, a.y), (b.x, b.y)) for a, b in combinations(starts, 2)) >= 1.0


def test_starts_depend_on_the_seed() -> None:
    world = make_world("office", 0)
    first, again, other = (random_starts(np.random.default_rng(seed), world, 3) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len({start.yaw for start in first}) == 3


def test_no_robot_starts_in_an_enclosed_area() -> None:
    closet = (box(6, 0, 6.2, 4), box(6, 3.8, 10, 4), box(6, 0, 10, 0.2), box(9.8, 0, 10, 4))
    world = World("closet", 0, (10, 10), closet)
    starts = [random_starts(np.random.default_rng(seed), world, 4) for seed in range(20)]
    assert not any(start.x > 6 and start.y < 4 for team in starts for start in team)


def test_too_many_robots_are_refused_with_the_possible_number(two_rooms: World) -> None:
    with pytest.raises(ValueError, match=r"robots is 500, .*'two rooms' .* for \d+ only"):
        random_starts(np.random.default_rng(0), two_rooms, 500)


def test_a_full_world_has_no_start() -> None:
    with pytest.raises(ValueError, match="room for 0 only"):
        random_starts(np.random.default_rng(0), World("solid", 0, (3, 3), (box(0, 0, 3, 3),)), 1)


def test_a_single_place_is_found() -> None:
    world = World("cell", 0, (1.4, 1.4), (box(0, 0, 0.15, 1.4), box(1.25, 0, 1.4, 1.4)))
    (start,) = random_starts(np.random.default_rng(0), world, 1)
    assert isinstance(start, SE2)
    assert start.x == pytest.approx(0.7, abs=0.051)
