"""Messages of robots: laws of growing maps, round trips, and refusals."""

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
from mapquilt.live.received_map import MapPatch, grid_of, kept_share, patched
from mapquilt.live.robots import Robot, heard
from mapquilt.live.settings import LiveSettings
from tests.mapquilt.live.floors import explored, floor, in_frame, message

WORLD = floor()


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))
def test_a_map_comes_through_a_message_cell_by_cell_with_any_origin(x, y, yaw):
    grid = OccupancyGrid(GridFrame(0.05, SE2(x, y, yaw), WORLD.frame.shape), WORLD.log_odds)
    received = grid_of(message(grid))
    np.testing.assert_array_equal(received.occupancy(), grid.occupancy())
    assert received.frame == grid.frame


def test_cells_in_percent_are_read_as_the_map_saver_writes_them():
    cells = np.array([-1, 0, 25, 26, 64, 65, 100], np.int8)
    grid = OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), (1, 7)), np.zeros((1, 7)))
    assert grid_of(message(grid, cells=cells)).occupancy().ravel().tolist() == [-1, 0, 0, -1, -1, 100, 100]


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"resolution": math.nan}, "resolution is nan, must be finite"),
        ({"resolution": 0.0}, "resolution is 0, must lie between 0.001 and 10 m"),
        ({"origin": (0.0, math.inf, 0.0)}, "origin y is inf, must be finite"),
        ({"origin": (0.0, 0.0, math.nan)}, "origin yaw is nan, must be finite"),
        ({"width": 0}, "map has 0 x 200 cells, must have at least one"),
        ({"width": 10**6, "height": 10**6}, "must have at most"),
        ({"cells": np.zeros(7, np.int8)}, "data has 7 cells, must have 400 x 200 as the map states"),
        ({"cells": np.full(WORLD.log_odds.size, 101, np.int8)}, "data has a cell outside of -1 to 100"),
    ],
)
def test_garbage_is_named_and_changes_nothing(changes, complaint):
    robot = heard(Robot("robot_0"), message(WORLD), 1.0)
    after = heard(robot, message(WORLD, **changes), 2.0)
    assert complaint in after.fault
    assert after.grid is robot.grid
    assert after.version == robot.version
    assert not heard(after, message(WORLD), 3.0).fault


def test_a_map_that_grows_and_shifts_its_raster_is_the_same_life():
    robot = Robot("robot_0")
    for step in range(1, 8):
        robot = heard(robot, message(explored(WORLD, 9.0 - step, 10.0 + step)), float(step))
    assert robot.life == 0
    assert robot.version == 7
    assert heard(robot, message(explored(WORLD, 2.0, 17.0)), 8.0).version == 7


@pytest.mark.parametrize(
    "change",
    [
        lambda grid: message(grid, frame="other/map"),
        lambda grid: message(explored(grid, 4.0, 5.0)),
        lambda grid: message(in_frame(grid, Similarity2(3.0, 1.0, 2.0))),
    ],
)
def test_a_robot_that_restarts_has_a_new_life(change):
    robot = heard(Robot("robot_0"), message(WORLD), 1.0)
    after = heard(robot, change(WORLD), 2.0)
    assert after.life == 1
    assert after.notes[0].startswith("restarted: its ")


def test_a_changed_resolution_is_told_and_keeps_the_frame():
    robot = heard(Robot("robot_0"), message(WORLD), 1.0)
    coarse = heard(robot, message(in_frame(WORLD, Similarity2(), resolution=0.1)), 2.0)
    assert coarse.life == 0
    assert coarse.notes == ("resolution changed from 0.05 to 0.1 m",)


@given(st.integers(0, 150), st.integers(0, 350), st.integers(1, 50), st.integers(1, 50))
def test_a_patch_changes_its_window_alone(y, x, height, width):
    cells = np.full((height, width), 100, np.int8)
    after = patched(message(WORLD), MapPatch("robot_0", 2.0, x, y, width, height, cells.ravel()))
    expected = WORLD.occupancy().copy()
    expected[y : y + height, x : x + width] = 100
    np.testing.assert_array_equal(after.cells.reshape(expected.shape), expected)


def test_a_patch_outside_the_map_or_before_it_is_a_fault():
    patch = MapPatch("robot_0", 2.0, 390, 0, 20, 1, np.zeros(20, np.int8))
    assert heard(Robot("robot_0"), patch, 1.0).fault == "an update came before the first map"
    robot = heard(Robot("robot_0"), message(WORLD), 1.0)
    assert heard(robot, patch, 2.0).fault == "window of 20 x 1 cells at 390, 0 must lie in the map of 400 x 200 cells"


def test_a_robot_is_silent_after_its_time():
    robot, settings = heard(Robot("robot_0"), message(WORLD), 10.0), LiveSettings()
    assert not robot.is_silent(10.0 + settings.silent_after, settings)
    assert robot.is_silent(10.1 + settings.silent_after, settings)


def test_a_map_keeps_all_of_itself_and_nothing_of_its_opposite():
    assert kept_share(WORLD, WORLD) == 1.0
    assert kept_share(WORLD, OccupancyGrid(WORLD.frame, -WORLD.log_odds)) == 0.0
