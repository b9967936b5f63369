"""Maps of robots that explore generated rooms, as messages: they grow, and their rasters shift."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapquilt.live.received_map import MapMessage

CELL = 0.05


def message(grid: OccupancyGrid, robot: str = "robot_0", stamp: float = 1.0, **changes) -> MapMessage:
    """The message of a grid; ``changes`` replace its fields."""
    rows, cols = grid.frame.shape
    origin = grid.frame.origin
    values = {
        "robot": robot,
        "stamp": stamp,
        "frame": f"{robot}/map",
        "resolution": grid.frame.resolution,
        "origin": (origin.x, origin.y, origin.yaw),
        "width": cols,
        "height": rows,
        "cells": grid.occupancy().ravel(),
    }
    return MapMessage(**{**values, **changes})


def floor(seed: int = 1, rooms: int = 4) -> OccupancyGrid:
    """Rooms of uneven widths with doors and furniture, 4 m deep in two rows along a corridor."""
    rng = np.random.default_rng(seed)
    side = 80
    values = np.zeros((2 * side + 40, 100 * rooms), np.int8)
    for low in (0, side + 40):
        cuts = [0, *(100 * k + int(rng.integers(-30, 30)) for k in range(1, rooms)), values.shape[1]]
        wall = low + side - 1 if low == 0 else low
        values[wall : wall + 2] = 100
        for left, right in itertools.pairwise(cuts):
            values[low : low + side, max(0, left - 1) : left + 1] = 100
            door = int(rng.integers(left + 10, right - 30))
            values[wall : wall + 2, door : door + 20] = 0
            for _ in range(4):
                row, col = int(rng.integers(low + 5, low + side - 20)), int(rng.integers(left + 5, right - 20))
                values[row : row + int(rng.integers(4, 14)), col : col + int(rng.integers(4, 14))] = 100
    values[[0, 1, -2, -1]] = 100
    values[:, [0, 1, -2, -1]] = 100
    return OccupancyGrid.from_occupancy(GridFrame(CELL, SE2(), values.shape), values)


def explored(world: OccupancyGrid, left: float, right: float) -> OccupancyGrid:
    """The part of a floor between two x [m]: its raster shifts as ``left`` falls."""
    first, last = (round(x / CELL) for x in (left, right))
    part = world.log_odds[:, first:last]
    return OccupancyGrid(world.frame.window((0, first), part.shape), part)


def in_frame(grid: OccupancyGrid, map_from_world: Similarity2, resolution: float = CELL) -> OccupancyGrid:
    """A map in the frame of a robot that started elsewhere."""
    rows, cols = grid.frame.shape
    corners = grid.frame.metres_from_cells(
        [(-0.5, -0.5), (-0.5, cols - 0.5), (rows - 0.5, -0.5), (rows - 0.5, cols - 0.5)]
    )
    moved = map_from_world.apply(corners)
    low, high = moved.min(axis=0), moved.max(axis=0)
    shape = tuple(math.ceil(side / resolution) for side in (high - low)[::-1].tolist())
    frame = GridFrame(resolution, SE2(*low.tolist()), shape)
    return OccupancyGrid(frame, resampled(grid, map_from_world, frame))
