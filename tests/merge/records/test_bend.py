"""Bend: laws of a smooth displacement field."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.records.bend import Bend

CORNER, SPACING, SHAPE = np.array([-3.0, 2.0]), 10.0, (4, 6, 2)
seeds = st.integers(0, 2**32 - 1)


def smooth(seed: int, size: float = 1.0) -> Bend:
    """A bend whose nodes differ by at most ``size``, a tenth of their distance."""
    return Bend(CORNER, SPACING, np.random.default_rng(seed).uniform(-size / 2.0, size / 2.0, SHAPE))


def points(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform((-2.0, 3.0), (46.0, 31.0), (50, 2))


@given(seeds)
def test_removing_a_bend_undoes_it(seed):
    bend = smooth(seed)
    assert np.allclose(bend.remove(bend.apply(points(seed))), points(seed), atol=2e-4)


def test_a_node_moves_by_its_displacement_and_between_nodes_it_is_interpolated():
    nodes = np.zeros(SHAPE)
    nodes[1, 2] = 3.0, -1.0
    bend = Bend(CORNER, SPACING, nodes)
    node = CORNER + SPACING * np.array([2.0, 1.0])
    assert np.allclose(bend.apply(node[None]) - node, (3.0, -1.0))
    half_way = node + np.array([5.0, 0.0])
    assert np.allclose(bend.apply(half_way[None]) - half_way, (1.5, -0.5))
    assert np.allclose(bend.apply(np.array([[100.0, 100.0]])), 100.0)  # the last node stands still


@given(seeds, st.floats(-20.0, 20.0), st.floats(-3.0, 3.0), st.floats(0.5, 2.0))
def test_a_change_taken_over_by_the_transform_leaves_the_whole(seed, x, yaw, scale):
    """Inside the control grid, the change and what remains of the bend move a point as the whole bend."""
    bend, change = smooth(seed), Similarity2(x, -x / 2.0, yaw, scale)
    rest = bend.relative_to(change)
    assert np.allclose(change.apply(rest.apply(points(seed))), bend.apply(points(seed)), atol=1e-9)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_a_shift_and_a_small_turn_are_no_strain(x, y):
    still = Bend(CORNER, SPACING, np.zeros(SHAPE))
    moved = still.relative_to(Similarity2(x, y, 1e-4))
    assert moved.strain == pytest.approx(0.0, abs=1e-7)


def test_the_strain_of_a_stretch_is_its_share():
    grown = Bend(CORNER, SPACING, np.zeros(SHAPE)).relative_to(Similarity2(scale=1.0 / 1.02))
    assert grown.strain == pytest.approx(0.02 * math.sqrt(2.0), rel=1e-9)


@given(seeds, st.integers(0, 2))
def test_a_grid_at_rest_covers_the_points_and_moves_none(seed, beyond):
    rest = Bend.at_rest(points(seed), 7.0, beyond)
    assert np.array_equal(rest.apply(points(seed)), points(seed))
    low, high = rest.places[0], rest.places[-1]
    assert (low <= points(seed).min(axis=0) - 7.0 * beyond + 1e-9).all()
    assert (high >= points(seed).max(axis=0) + 7.0 * beyond - 1e-9).all()
    assert len(rest.places) == rest.nodes.shape[0] * rest.nodes.shape[1]


def test_a_grid_is_bent_as_its_points():
    cells = np.zeros((40, 60), np.int8)
    cells[20, 10:50] = 100
    grid = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), cells.shape), cells)
    nodes = np.zeros((5, 7, 2))
    nodes[..., 1] = 4.0  # all of it four rows higher
    bent = Bend(np.zeros(2), 10.0, nodes).resample(grid)
    assert np.array_equal(np.argwhere(bent.occupied), np.argwhere(grid.occupied) + np.array([4, 0]))
    assert np.count_nonzero(bent.known[:4]) == 0
