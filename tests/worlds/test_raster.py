"""The true raster against exact clipping in fractions."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from worlds.families.registry import make_world
from worlds.polygon import box, turned_box
from worlds.raster import true_raster
from worlds.world import World

Corner = tuple[Fraction, Fraction]


def shared_area(polygon: np.ndarray, col: int, row: int, resolution: float) -> Fraction:
    """The exact area that a polygon shares with a cell (Sutherland and Hodgman, CACM 1974)."""
    cell = Fraction(resolution)
    corners = [(Fraction(x), Fraction(y)) for x, y in polygon.tolist()]
    left, right, low, high = col * cell, (col + 1) * cell, row * cell, (row + 1) * cell
    for axis, sign, bound in ((0, 1, left), (0, -1, right), (1, 1, low), (1, -1, high)):
        corners = _clipped(corners, axis, sign, bound)
    following = corners[1:] + corners[:1]
    doubled = sum((a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, following, strict=True)), Fraction(0))
    return abs(doubled) / 2


def _clipped(corners: list[Corner], axis: int, sign: int, bound: Fraction) -> list[Corner]:
    kept: list[Corner] = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        depth_a, depth_b = sign * (a[axis] - bound), sign * (b[axis] - bound)
        if depth_a >= 0:
            kept.append(a)
        if (depth_a > 0 > depth_b) or (depth_a < 0 < depth_b):
            share = depth_a / (depth_a - depth_b)
            kept.append((a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])))
    return kept


def oracle(world: World, resolution: float, shape: tuple[int, int]) -> np.ndarray:
    occupied = np.zeros(shape, dtype=bool)
    for row, col in np.ndindex(shape):
        occupied[row, col] = any(shared_area(polygon, col, row, resolution) > 0 for polygon in world.obstacles)
    return occupied


def star(rng: np.random.Generator, on_grid: bool) -> np.ndarray:
    """A random star-shaped polygon, mostly concave; with its corners on grid vertices if asked for."""
    angles = np.sort(rng.uniform(0, math.tau, 9))
    reach = rng.uniform(0.1, 0.95, 9)
    corners = 1.0 + np.stack((reach * np.cos(angles), reach * np.sin(angles)), axis=-1)
    return np.round(corners * 8) / 8 if on_grid else corners


@pytest.mark.slow
@pytest.mark.parametrize("on_grid", [False, True])
def test_any_touch_agrees_with_exact_clipping(on_grid: bool) -> None:
    rng = np.random.default_rng(5)
    tried = 0
    while tried < 12:
        try:
            world = World("star", 0, (2, 2), (star(rng, on_grid),))
        except ValueError:
            continue
        tried += 1
        raster = true_raster(world, resolution=0.125)
        assert np.array_equal(raster.occupied, oracle(world, 0.125, (16, 16)))
        assert raster.known.all()


def test_a_wall_drawn_on_the_raster_fills_its_own_cells_only() -> None:
    world = World("wall", 0, (1.0, 0.5), (box(0.15, 0.1, 0.30, 0.45),))
    expected = np.zeros((10, 20), dtype=bool)
    expected[2:9, 3:6] = True
    assert np.array_equal(true_raster(world, 0.05).occupied, expected)


def test_obstacles_thinner_than_a_cell_are_kept() -> None:
    hair = true_raster(World("hair", 0, (1, 1), (turned_box(0.525, 0.525, 0.02, 0.001, 0.3),)), 0.05)
    assert np.argwhere(hair.occupied).tolist() == [[10, 10]]
    sliver = true_raster(World("sliver", 0, (1, 1), (box(0.1, 0.1, 0.2001, 0.2),)), 0.05)
    assert np.argwhere(sliver.occupied.any(axis=0)).ravel().tolist() == [2, 3, 4]


def test_row_zero_is_lowest_and_the_origin_is_that_of_the_world() -> None:
    raster = true_raster(World("corner", 0, (2.0, 1.03), (box(0.0, 0.0, 0.5, 0.1),)), 0.1)
    assert raster.frame.shape == (11, 20)
    assert raster.frame.origin == SE2(0.0, 0.0, 0.0)
    assert np.argwhere(raster.occupied).tolist() == [[0, 0], [0, 1], [0, 2], [0, 3], [0, 4]]


def test_just_behind_every_side_of_an_office_is_an_occupied_cell() -> None:
    world = make_world("office", 3)
    along = np.diff(world.segments(), axis=1)[:, 0]
    inward = world.segments().mean(axis=1) + 1e-6 * along[:, ::-1] * (-1, 1)
    raster = true_raster(world)
    cells = raster.frame.cells_from_metres(np.clip(inward, 1e-9, np.array(world.size) - 1e-9))
    assert raster.occupied[tuple(cells.T)].all()


@pytest.mark.parametrize("resolution", [0.0, -0.05, math.nan, math.inf])
def test_bad_resolutions_are_refused(resolution: float) -> None:
    with pytest.raises(ValueError, match=f"resolution is {resolution}"):
        true_raster(World("any", 0, (1, 1), ()), resolution)
