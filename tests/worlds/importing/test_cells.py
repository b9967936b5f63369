"""Worlds of free cells: free cells are free and all others solid, exactly."""

from __future__ import annotations

import numpy as np
import pytest

from worlds.importing.cells import world_from_cells
from worlds.raster import true_raster


def rooms(seed: int) -> np.ndarray:
    """Random rooms in solid ground, row 0 lowest."""
    rng = np.random.default_rng(seed)
    free = np.zeros((60, 80), dtype=bool)
    for row, col in rng.integers(2, (45, 60), (12, 2)):
        free[row : row + int(rng.integers(3, 13)), col : col + int(rng.integers(3, 18))] = True
    return free


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("resolution", [0.05, 0.1, 0.037])
def test_the_raster_of_a_plan_is_the_plan_cell_for_cell(seed: int, resolution: float) -> None:
    free = rooms(seed)
    world = world_from_cells("plan", free, resolution)
    assert np.array_equal(true_raster(world, resolution).free, free)
    assert world.size == (80 * resolution, 60 * resolution)


def test_equal_runs_of_rows_become_one_box() -> None:
    free = np.zeros((20, 30), dtype=bool)
    free[5:15, 5:25] = True
    assert len(world_from_cells("one room", free, 0.1).obstacles) == 4
    assert len(world_from_cells("turned", free.T, 0.1).obstacles) == 4


def test_outdoor_cells_become_solid() -> None:
    free = np.ones((40, 40), dtype=bool)
    free[5:35, 5:35] = False
    free[7:33, 7:33] = True
    world = world_from_cells("house in a white margin", free, 0.1)
    indoors = np.zeros_like(free)
    indoors[7:33, 7:33] = True
    assert np.array_equal(true_raster(world, 0.1).free, indoors)


def test_an_open_plan_gets_a_wall_of_10_cm_around_it() -> None:
    free = np.ones((40, 30), dtype=bool)
    free[20, 10:] = False
    world = world_from_cells("open", free, 0.04)
    assert world.size == pytest.approx((36 * 0.04, 46 * 0.04))
    raster = true_raster(world, 0.04)
    assert np.array_equal(raster.free[3:-3, 3:-3], free)
    assert raster.free.sum() == free.sum()


def test_plans_without_floor_and_with_too_much_detail_are_refused() -> None:
    with pytest.raises(ValueError, match="no free cell"):
        world_from_cells("black", np.zeros((5, 5), dtype=bool), 0.1)
    with pytest.raises(ValueError, match=r"take \d+ boxes, at most 10000"):
        world_from_cells("noise", np.random.default_rng(0).random((300, 300)) < 0.6, 0.05)
