"""Straightening: walls that drifted out of parallel become parallel, other maps stay."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.multimap.settings import StraighteningSettings
from merge.multimap.straightening import straighten
from merge.preparation.prepared_map import PreparedMap
from merge.records.bend import Bend

SETTINGS = StraighteningSettings()


def rooms() -> OccupancyGrid:
    """Four by three rooms of 60 cells, with walls of two cells and doors."""
    cells = np.full((182, 242), -2.0, np.float32)
    for k in range(4):
        cells[60 * k : 60 * k + 2] = 2.0
    for k in range(5):
        cells[:, 60 * k : 60 * k + 2] = 2.0
    for k in range(3):
        cells[60 * k + 25 : 60 * k + 40, 2:-2] = -2.0
    cells[2:-2, 20:35] = -2.0
    cells[2:-2, 140:155] = -2.0
    return OccupancyGrid(GridFrame(0.05, SE2(), cells.shape), cells)


def bowed(grid: OccupancyGrid, degrees: float) -> tuple[OccupancyGrid, Bend]:
    """Bend a map along an arc, so that its left and right ends turn by ``degrees`` either way."""
    padded = grid.cropped(30)
    rows, cols = padded.frame.shape
    spacing = 10.0
    shape = math.ceil(rows / spacing) + 1, math.ceil(cols / spacing) + 1
    row, col = np.indices(shape)
    x, y = spacing * col - cols / 2.0, spacing * row - rows / 2.0
    turn = math.radians(degrees) * x / (cols / 2.0)
    nodes = np.stack((-turn * y, turn * x / 2.0), axis=-1)
    bend = Bend(np.zeros(2), spacing, nodes)
    return bend.resample(padded), bend


@pytest.mark.parametrize("degrees", [3.0, -5.0])
def test_a_bowed_map_becomes_straight(degrees):
    bent, bow = bowed(rooms(), degrees)
    prepared = PreparedMap(bent)
    back = straighten(prepared, SETTINGS)
    assert back is not None
    true = bow.remove(prepared.points)

    def off(points):
        """Root mean square distance from the true points, after the best rigid motion."""
        p, q = points - points.mean(axis=0), true - true.mean(axis=0)
        turn = math.atan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
        c, s = math.cos(turn), math.sin(turn)
        return math.sqrt(np.square(p @ np.array([[c, s], [-s, c]]) - q).sum(axis=1).mean())

    assert off(prepared.points) > 1.0
    assert off(back.apply(prepared.points)) < 0.5 * off(prepared.points)


def test_a_straight_map_stays():
    assert straighten(PreparedMap(rooms()), SETTINGS) is None


def test_a_turned_straight_map_stays():
    grid, angle = rooms(), math.radians(20.0)
    side = 340
    row, col = np.indices((side, side))
    x, y = col - side / 2.0, row - side / 2.0
    there = np.stack(
        (math.cos(angle) * y - math.sin(angle) * x + 91.0, math.sin(angle) * y + math.cos(angle) * x + 121.0)
    ).astype(int)
    inside = (there[0] >= 0) & (there[0] < 182) & (there[1] >= 0) & (there[1] < 242)
    cells = np.where(inside, grid.log_odds[there[0].clip(0, 181), there[1].clip(0, 241)], 0.0).astype(np.float32)
    assert straighten(PreparedMap(OccupancyGrid(GridFrame(0.05, SE2(), cells.shape), cells)), SETTINGS) is None


def test_round_walls_are_no_drift():
    row, col = np.indices((200, 260))
    cells = np.full((200, 260), -2.0, np.float32)
    for x, y, radius in ((70, 70, 50), (180, 90, 65), (90, 150, 40), (200, 170, 25)):
        cells[np.abs(np.hypot(col - x, row - y) - radius) < 1.2] = 2.0
    assert straighten(PreparedMap(OccupancyGrid(GridFrame(0.05, SE2(), cells.shape), cells)), SETTINGS) is None


def test_a_map_of_few_walls_stays():
    bent, _ = bowed(rooms(), 4.0)
    assert straighten(PreparedMap(bent), dataclasses.replace(SETTINGS, min_points=10**6)) is None
