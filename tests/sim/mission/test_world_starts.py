"""Starts in every family of worlds: clear, apart, given ones first, and distributed over the parts."""

from __future__ import annotations

import numpy as np
import pytest

from sim.mission.starts import random_starts
from worlds.families.registry import FAMILIES, make_world
from worlds.floor import CLEAR, find_floor


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_starts_are_inside_clear_and_apart(name: str) -> None:
    for seed in range(3):
        world = make_world(name, seed)
        starts = random_starts(np.random.default_rng(seed), world, 4)
        places = np.array([(start.x, start.y) for start in starts])
        assert world.clearance(places).min() >= CLEAR
        gaps = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
        assert gaps[np.triu_indices(4, 1)].min() >= 2.0 * CLEAR
        for start, own in zip(starts, world.starts, strict=False):
            assert start == own or name == "thesis_hall"


@pytest.mark.parametrize("seed", range(5))
def test_robots_of_a_disjoint_world_start_in_different_parts(seed: int) -> None:
    world = make_world("disjoint", seed)
    floor = find_floor(world)
    starts = random_starts(np.random.default_rng(seed), world, 6)
    cells = floor.frame.cells_from_metres([(start.x, start.y) for start in starts])
    parts = floor.part[tuple(cells.T)].tolist()
    assert sorted(parts[:4]) == [1, 2, 3, 4]
    assert parts[4:] == parts[:2]
