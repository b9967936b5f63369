"""Images that are not maps are refused without a crash."""

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from skimage import data

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map
from mapping.map_set import MapSet
from merge import MergeSettings, ScaleRange
from merge.merger import match_maps
from tests.merge.rooms import observed, rooms, viewpoints

PICTURES = {"photograph": data.camera, "coins": data.coins, "text": data.page, "brick": data.brick, "moon": data.moon}
SIDE = 256


@pytest.fixture(scope="module")
def floor():
    rng = np.random.default_rng(3)
    world = rooms(rng, 12.0, 9.0)
    return observed(world, viewpoints(world, rng, (0.3, 0.3), (11.7, 8.7), number=15), Similarity2(), rng)


def matched(target: OccupancyGrid, source: OccupancyGrid, method: str = "quilt"):
    settings = MergeSettings(method, scale=ScaleRange.free())
    (pair,) = match_maps(MapSet(("a", "b"), (target, source), ("cell", "cell"), False), settings)
    return pair


def picture(name, tmp_path):
    grey = PICTURES[name]()
    path = tmp_path / f"{name}.png"
    cv2.imwrite(
        str(path), cv2.resize(grey, (SIDE, SIDE * grey.shape[0] // grey.shape[1]), interpolation=cv2.INTER_AREA)
    )
    return load_map(path).grid


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_of_something_else_is_refused_with_a_reason(name, floor, tmp_path):
    pair = matched(floor, picture(name, tmp_path))
    assert not pair.accepted and pair.reason


def test_two_photographs_are_refused(tmp_path):
    assert not matched(picture("photograph", tmp_path), picture("coins", tmp_path)).accepted


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    values=arrays(np.int8, st.tuples(st.integers(1, 40), st.integers(1, 40)), elements=st.sampled_from([-1, 0, 100])),
    stretch=st.integers(1, 3),
)
def test_any_little_raster_is_refused(floor, values, stretch):
    values = np.kron(values, np.ones((stretch, stretch), np.int8))
    grid = OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values)
    pair = matched(floor, grid)
    assert not pair.accepted and pair.reason
