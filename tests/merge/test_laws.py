"""Equivariance: a motion of an input moves the answer by the same, over random draws."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.frame_perturbation import perturb_frame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge import MergeSettings, ScaleRange
from merge.merger import match_maps
from tests.merge.rooms import CELL, observed, rooms, viewpoints

FREE = MergeSettings("quilt", scale=ScaleRange(0.4, 2.5))
DRAWS = settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])

yaws = st.floats(-math.pi, math.pi)
shifts = st.floats(-30.0, 30.0)
scales = st.floats(0.7, 1.4)
moves = st.builds(Similarity2, shifts, shifts, yaws, scales)


def answer(target: OccupancyGrid, source: OccupancyGrid) -> Similarity2:
    (pair,) = match_maps(MapSet(("a", "b"), (target, source), ("m", "m"), False), FREE)
    assert pair.accepted, pair.reason
    return pair.target_from_source


def off_cells(found: Similarity2, expected: Similarity2, source: OccupancyGrid) -> float:
    """Mean displacement of the source's walls, in cells of the source."""
    points = source.frame.metres_from_cells(np.argwhere(source.occupied))
    apart = np.hypot(*(found.apply(points) - expected.apply(points)).T).mean()
    return float(apart / (expected.scale * source.frame.resolution))


@pytest.fixture(scope="module")
def pair():
    rng = np.random.default_rng(3)
    world = rooms(rng, 14.0, 10.0)
    parts = ((0.3, 0.3), (10.0, 9.7)), ((4.0, 0.3), (13.7, 9.7))
    grids = [
        observed(world, viewpoints(world, rng, *part, number=20), Similarity2(), rng, noise=0.01) for part in parts
    ]
    return grids, answer(*grids)


@pytest.mark.slow
@DRAWS
@example(move=Similarity2(0.0, 0.0, math.pi / 2.0))
@given(move=moves)
def test_moving_the_source_moves_the_answer(pair, move):
    (target, source), before = pair
    moved = perturb_frame(source, move)  # move: source from moved
    assert off_cells(answer(target, moved), before @ move, moved) < 1.0


@pytest.mark.slow
@DRAWS
@given(move=moves)
def test_moving_the_target_moves_the_answer_the_other_way(pair, move):
    (target, source), before = pair
    expected = move.inverse() @ before
    assert off_cells(answer(perturb_frame(target, move), source), expected, source) < 1.0


@pytest.mark.slow
@DRAWS
@given(move=moves)
def test_swapping_moved_maps_gives_the_inverse(pair, move):
    (target, source), _ = pair
    moved = perturb_frame(source, move)
    there, back = answer(target, moved), answer(moved, target)
    assert off_cells(back.inverse(), there, moved) < 1e-6


def test_a_quarter_turn_of_the_raster_rotates_the_answer(pair):
    (target, source), before = pair
    values = np.rot90(source.log_odds, -1)  # rows go up: turned clockwise as an array, to the left as a map
    turned = OccupancyGrid(GridFrame(CELL, SE2(), values.shape), values)
    corner = source.frame.metres_from_cells(np.array([[source.frame.shape[0] - 0.5, -0.5]]))[0]
    source_from_turned = Similarity2(*corner.tolist(), -math.pi / 2.0)
    assert off_cells(answer(target, turned), before @ source_from_turned, turned) < 0.5


@pytest.mark.parametrize("stated", [0.025, 0.2])
def test_a_source_that_states_other_cells_has_another_scale(pair, stated):
    (target, source), before = pair
    frame = GridFrame(stated, SE2(), source.frame.shape)
    restated = OccupancyGrid(frame, source.log_odds)
    size = CELL / stated
    origin = source.frame.origin
    source_from_restated = Similarity2(origin.x, origin.y, origin.yaw, size)
    wide = MergeSettings("quilt", scale=ScaleRange(0.2, 2.5))
    (found,) = match_maps(MapSet(("a", "b"), (target, restated), ("m", "m"), False), wide)
    assert found.accepted, found.reason
    assert off_cells(found.target_from_source, before @ source_from_restated, restated) < 1.0
