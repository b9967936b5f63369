"""Paths through a map."""

from __future__ import annotations

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from sim.navigation.routes import Routes


def hall_with_wall(gap_cells: int) -> OccupancyGrid:
    """6 x 4 m at 0.1 m, its corner at (-1, -2); a wall at x = 2 with a gap at its upper end."""
    occupancy = np.zeros((40, 60), dtype=np.int8)
    occupancy[: 40 - gap_cells, 30] = 100
    return OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(-1.0, -2.0, 0.0), (40, 60)), occupancy)


def test_a_path_goes_around_a_wall_at_a_distance() -> None:
    grid = hall_with_wall(gap_cells=10)
    routes = Routes(grid, np.array((0.05, -1.45)), radius=0.2)
    goal = grid.frame.cells_from_metres([(4.05, -1.45)])[0]
    path = routes.path_to(goal)
    assert np.allclose(path[0], (0.05, -1.45))
    assert np.allclose(path[-1], (4.05, -1.45))
    wall = grid.frame.metres_from_cells(np.argwhere(grid.occupied))
    assert np.hypot(*(path[:, None] - wall).transpose(2, 0, 1)).min() > 0.3
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    assert 2 * np.hypot(2.0, 2.7) < length <= routes.costs[tuple(goal)] + 1e-6


def test_a_gap_too_narrow_for_the_robot_is_closed() -> None:
    grid = hall_with_wall(gap_cells=2)
    routes = Routes(grid, np.array((0.05, -1.45)), radius=0.2)
    assert np.isinf(routes.costs[:, 34:]).all()
    assert np.isfinite(routes.costs[5, :20]).all()


def test_unknown_cells_are_closed() -> None:
    occupancy = np.zeros((20, 40), dtype=np.int8)
    occupancy[:, 20] = -1
    grid = OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(), (20, 40)), occupancy)
    routes = Routes(grid, np.array((0.5, 1.0)), radius=0.2)
    assert np.isfinite(routes.costs[:, :20]).all()
    assert np.isinf(routes.costs[:, 20:]).all()


def test_a_robot_at_a_wall_finds_a_path() -> None:
    grid = hall_with_wall(gap_cells=10)
    routes = Routes(grid, np.array((1.8, -1.45)), radius=0.2)
    assert np.isfinite(routes.costs[5, 5])
