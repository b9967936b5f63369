"""Landmarks: small objects are found, and their pattern gives the transform."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge import MergeSettings, ScaleRange
from merge.merger import match_maps
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.landmarks import Landmarks
from tests.merge.rooms import CELL, World, observed, viewpoints

MARKS = Landmarks()
FREE = ScaleRange.free()


def discs(centres, radii, rows, cols):
    """A prepared map of round things in free space, x and y in cells."""
    y, x = np.indices((rows, cols)) + 0.5
    values = np.full((rows, cols), -1.0, np.float32)
    for (cx, cy), radius in zip(centres, radii, strict=True):
        values[np.hypot(x - cx, y - cy) <= radius] = 1.0
    return PreparedMap(OccupancyGrid(GridFrame(1.0, SE2(), (rows, cols)), values))


def trees(seed, number=25, side=300.0):
    rng = np.random.default_rng(seed)
    centres = []
    while len(centres) < number:
        point = rng.uniform(15.0, side - 15.0, 2)
        if all(np.hypot(*(point - other)) > 25.0 for other in centres):
            centres.append(point)
    return np.array(centres), rng.uniform(3.0, 6.0, number)


def proposals(target, source, scale=FREE):
    return MARKS.propose(MARKS.describe(target), MARKS.describe(source), scale, np.random.default_rng(0))


def test_landmarks_have_the_right_position_and_size():
    centres, radii = np.array([(40.0, 30.5), (120.5, 90.0), (60.0, 150.0)]), (4.0, 7.0, 5.5)
    marks, diagonal = MARKS.describe(discs(centres, radii, 200, 160))
    assert diagonal == pytest.approx(math.hypot(200, 160))
    order = np.argsort(-np.array(radii))  # those of most cells first
    np.testing.assert_allclose(marks[:, :2], centres[order], atol=0.5)
    np.testing.assert_allclose(marks[:, 2], 2.0 * np.array(radii)[order], atol=1.0)


def test_long_walls_and_single_cells_are_not_landmarks():
    prepared = discs([(40.0, 30.0)], [4.0], 120, 160)
    values = prepared.grid.log_odds.copy()
    values[80:83, 10:150] = values[20, 120] = 1.0
    marks, _ = MARKS.describe(PreparedMap(OccupancyGrid(prepared.grid.frame, values)))
    assert len(marks) == 1


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    yaw=st.floats(-math.pi, math.pi),
    size=st.floats(0.6, 1.6),
    shift=st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0)),
    seed=st.integers(0, 50),
)
def test_the_transform_is_found_if_a_third_of_the_landmarks_is_common(yaw, size, shift, seed):
    centres, radii = trees(seed)
    order = np.argsort(centres[:, 0], kind="stable")
    centres, radii = centres[order], radii[order]
    target = discs(centres[:17], radii[:17], 300, 300)  # 8 to 16 are common
    seen = Similarity2(*shift, yaw, size).inverse().apply(centres[8:])
    seen -= seen.min(axis=0) - 12.0
    cols, rows = np.ceil(seen.max(axis=0) + 12.0).astype(int).tolist()
    found = proposals(target, discs(seen, radii[8:] / size, rows, cols))
    off = np.hypot(*(found[0].target_from_source.apply(seen[:9]) - centres[8:17]).T)
    assert off.max() < 3.0
    assert found[0].inliers >= 8


def test_sizes_that_do_not_fit_are_not_matched():
    centres, radii = trees(3, 12)
    small, large = discs(centres, radii / 2.0, 300, 300), discs(centres, radii * 2.0, 300, 300)
    same = proposals(large, large)
    assert same[0].inliers == 12
    assert all((p.inliers or 0) < 8 for p in proposals(large, small))


def test_a_known_scale_is_kept():
    centres, radii = trees(5, 15)
    prepared = discs(centres, radii, 300, 300)
    found = proposals(prepared, prepared, ScaleRange.known())
    assert found and all(p.target_from_source.scale == 1.0 for p in found)
    assert not [p for p in proposals(prepared, prepared, ScaleRange(1.5, 2.0)) if (p.inliers or 0) > 6]


def test_too_few_landmarks_give_no_proposal():
    few = discs([(40.0, 40.0), (90.0, 50.0), (60.0, 100.0)], [5.0, 5.0, 5.0], 150, 150)
    assert proposals(few, few) == ()
    nothing = PreparedMap(OccupancyGrid(GridFrame(1.0, SE2(), (5, 5)), np.zeros((5, 5), np.float32)))
    assert proposals(few, nothing) == ()


def test_two_maps_of_a_wood_that_share_a_third_are_merged():
    rng = np.random.default_rng(2)
    walls = np.zeros((320, 640), dtype=bool)
    y, x = np.indices(walls.shape)
    for _ in range(70):
        cx, cy, radius = rng.uniform(10, 630), rng.uniform(10, 310), rng.uniform(4, 8)
        walls |= np.hypot(x - cx, y - cy) < radius
    world = World(walls)
    frames = Similarity2(), Similarity2(4.0, -3.0, 2.0)
    grids = [
        observed(world, viewpoints(world, rng, *part, number=18), frame, rng, noise=0.01)
        for part, frame in zip((((3.0, 3.0), (16.0, 13.0)), ((16.0, 3.0), (29.0, 13.0))), frames, strict=True)
    ]
    (pair,) = match_maps(MapSet(("a", "b"), tuple(grids), ("m", "m"), False), MergeSettings("quilt", scale=FREE))
    assert pair.accepted, pair.reason
    points = grids[1].frame.metres_from_cells(np.argwhere(grids[1].occupied))
    truth = frames[0] @ frames[1].inverse()
    assert np.hypot(*(pair.target_from_source.apply(points) - truth.apply(points)).T).mean() < CELL
