"""Frontiers and the area visible from them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.routes import Routes
from sim.policies.frontiers import viewpoints, visible_unknown


def grid_of(occupancy: np.ndarray) -> OccupancyGrid:
    shape = (occupancy.shape[0], occupancy.shape[1])
    return OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), shape), occupancy)


def walled(rows: int, cols: int) -> np.ndarray:
    occupancy = np.full((rows, cols), 100, dtype=np.int8)
    occupancy[1:-1, 1:-1] = 0
    return occupancy


def test_a_fully_known_room_has_no_frontier() -> None:
    grid = grid_of(walled(40, 60))
    assert len(viewpoints(grid, Routes(grid, np.array((1.0, 1.0)), 0.2)).cells) == 0


def test_the_frontier_of_a_half_seen_room_is_its_middle_line() -> None:
    occupancy = walled(41, 80)
    occupancy[1:-1, 40:-1] = -1
    grid = grid_of(occupancy)
    views = viewpoints(grid, Routes(grid, np.array((1.0, 1.0)), 0.2))
    assert views.cells.tolist() == [[20, 39]]
    assert views.cost[0] >= math.hypot(2.95, 1.05) - 0.1
    assert views.gain[0] > 8.0


def test_unknown_floor_behind_a_wall_adds_no_gain() -> None:
    occupancy = walled(41, 121)
    occupancy[1:-1, 60] = 100
    occupancy[1:-1, 61:-1] = -1
    grid = grid_of(occupancy)
    assert visible_unknown(grid, np.array([(20, 40)])).tolist() == [0.0]


def test_gain_in_the_open_is_the_area_of_the_disc() -> None:
    occupancy = np.full((101, 101), -1, dtype=np.int8)
    gain = visible_unknown(grid_of(occupancy), np.array([(50, 50), (0, 0)]))
    assert gain == pytest.approx([math.pi * 4.0**2] * 2, rel=0.05)


def test_a_frontier_out_of_reach_gives_no_viewpoint() -> None:
    occupancy = walled(41, 121)
    occupancy[1:-1, 60] = 100
    occupancy[1:-1, 100:-1] = -1
    grid = grid_of(occupancy)
    assert len(viewpoints(grid, Routes(grid, np.array((1.0, 1.0)), 0.2)).cells) == 0
