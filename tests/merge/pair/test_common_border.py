"""A border, a frame or a straight corridor that two maps have in common is no evidence that they show one place."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.merger import match_maps
from merge.records.result import PairResult
from merge.settings import MergeSettings
from worlds.families.registry import make_world
from worlds.raster import true_raster

RESOLUTION = 0.05
UNKNOWN, FREE, WALL = -1, 0, 100


@pytest.mark.parametrize("seed", range(4))
def test_two_corridors_with_other_doors_and_rooms_are_refused(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    pair = matched(corridor(rng), corridor(rng))
    assert not pair.accepted
    assert pair.confidence < 0.5


@pytest.mark.parametrize(("first", "second"), [("office", "house"), ("maze", "warehouse"), ("house", "hospital")])
@pytest.mark.parametrize("title", [False, True])
def test_two_plans_in_one_drawing_frame_are_refused(first: str, second: str, title: bool) -> None:
    pair = matched(sheet(first, 1001, title), sheet(second, 1002, title))
    assert not pair.accepted
    assert pair.confidence < 0.5


def matched(a: np.ndarray, b: np.ndarray) -> PairResult:
    grids = tuple(OccupancyGrid.from_occupancy(GridFrame(RESOLUTION, SE2(), cells.shape), cells) for cells in (a, b))
    (pair,) = match_maps(MapSet(("a", "b"), grids, ("m", "m"), resolutions_trusted=True), MergeSettings())
    return pair


def corridor(rng: np.random.Generator) -> np.ndarray:
    """Draw a corridor of 25 x 2 m with walls, doors and rooms of its own."""
    cells = np.full((280, 540), UNKNOWN, np.int8)
    low, high, start, end = 120, 160, 20, 520
    room(cells, slice(low, high), slice(start, end))
    for above in (False, True):
        at = start + int(rng.uniform(20, 80))
        while at < end - 60:
            width, depth = int(rng.uniform(60, 120)), int(rng.uniform(50, 90))
            door = at + int(rng.uniform(8, width - 30))
            if rng.random() < 0.6:
                rows = slice(high + 2, high + 2 + depth) if above else slice(low - 2 - depth, low - 2)
                room(cells, rows, slice(at, at + width))
                cells[slice(high, high + 2) if above else slice(low - 2, low), door : door + 18] = FREE
            at += width + int(rng.uniform(4, 40))
    return cells


def room(cells: np.ndarray, rows: slice, cols: slice) -> None:
    """Draw a free rectangle with walls of two cells around it."""
    around = cells[rows.start - 2 : rows.stop + 2, cols.start - 2 : cols.stop + 2]
    around[around == UNKNOWN] = WALL
    cells[rows, cols] = FREE


def sheet(family: str, seed: int, title: bool) -> np.ndarray:
    """Draw the walls of a world on paper with a frame, and with a title block if asked."""
    free = true_raster(make_world(family, seed), RESOLUTION).free
    walls = (~free & (ndimage.distance_transform_edt(~free) <= 4))[:580, :780]
    cells = np.full((700, 900), FREE, np.int8)
    rows, cols = (700 - walls.shape[0]) // 2, (900 - walls.shape[1]) // 2
    cells[rows : rows + walls.shape[0], cols : cols + walls.shape[1]][walls] = WALL
    for band in (slice(20, 23), slice(677, 680)):
        cells[band, 20:880] = WALL
    for band in (slice(20, 23), slice(877, 880)):
        cells[20:680, band] = WALL
    if title:
        cells[[60, 100], 580:880] = cells[20:100, [580]] = WALL
    return cells
