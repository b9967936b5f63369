"""Resampling by rows and coarsening, against slow oracles."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import Resampling, coarsened, resampled


def random_grid(seed: int, shape: tuple[int, int]) -> OccupancyGrid:
    rng = np.random.default_rng(seed)
    log_odds = rng.normal(size=shape).astype(np.float32) * (rng.random(shape) < 0.3)
    return OccupancyGrid(GridFrame(0.05, SE2(1.0, -2.0, 0.3), shape), log_odds)


@pytest.mark.parametrize("step", [1, 7, 40, 1000])
def test_rows_together_are_the_whole(step: int) -> None:
    grid = random_grid(0, (60, 45))
    frame = GridFrame(0.08, SE2(0.0, -3.0, -0.4), (70, 60))
    place = Similarity2(0.2, 0.1, 0.5, 1.1)
    resampling = Resampling(grid, place, frame)
    bands = [resampling.rows(first, min(first + step, 70)) for first in range(0, 70, step)]
    np.testing.assert_array_equal(np.vstack(bands), resampled(grid, place, frame))


@pytest.mark.parametrize(("times", "shape"), [(1, (5, 8)), (3, (9, 12)), (4, (10, 7)), (50, (10, 7))])
def test_a_block_is_occupied_if_any_cell_is_and_else_free_if_any_is(times: int, shape: tuple[int, int]) -> None:
    grid = random_grid(1, shape)
    small = coarsened(grid, times)
    for row, col in np.ndindex(small.frame.shape):
        block = grid.log_odds[row * times : (row + 1) * times, col * times : (col + 1) * times]
        expected = block.max() if (block > 0).any() else block.min()
        assert small.log_odds[row, col] == expected
    walls = np.argwhere(grid.occupied)
    cells = small.frame.cells_from_metres(grid.frame.metres_from_cells(walls))
    assert small.occupied[cells[:, 0], cells[:, 1]].all()
