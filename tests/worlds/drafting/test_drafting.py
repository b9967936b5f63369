"""Drafted plans: walls are where they are in the world, by the pose that is told, in every style."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.seeds import Role, stream
from worlds.drafting.drafting import draft_plan
from worlds.drafting.sheet import pixels_from_metres, turned
from worlds.drafting.structure import find_structure
from worlds.drafting.style import STYLES, draw_style
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World

PAPER = 255


def world(*obstacles: np.ndarray) -> World:
    return World("test", 0, (10.0, 8.0), obstacles)


@given(x=st.floats(-20.0, 20.0), y=st.floats(-20.0, 20.0), yaw=st.floats(-3.1, 3.1), resolution=st.floats(0.01, 0.2))
def test_pixels_from_metres_inverts_the_frame(x: float, y: float, yaw: float, resolution: float) -> None:
    frame = GridFrame(resolution, SE2(x, y, yaw), (70, 90))
    pixels = np.array([(0.0, 0.0), (89.0, 69.0), (12.5, 3.25)])
    metres = np.column_stack((pixels, np.ones(3))) @ frame.metre_from_pixel().T
    np.testing.assert_allclose(pixels_from_metres(frame, metres[:, :2]), pixels, atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(angle=st.floats(-7.0, 7.0), row=st.integers(10, 110), col=st.integers(10, 160))
def test_a_turned_sheet_shows_each_point_where_its_frame_says(angle: float, row: int, col: int) -> None:
    grey = np.full((120, 170), PAPER, np.uint8)
    grey[row - 3 : row + 4, col - 3 : col + 4] = 0
    frame = GridFrame(0.05, SE2(1.0, -2.0, 0.0), grey.shape)
    shown, new = turned(grey, frame, angle, PAPER)
    ink = 255.0 - shown
    dark = np.array([(ink.sum(axis=0) @ np.arange(shown.shape[1])), (ink.sum(axis=1) @ np.arange(shown.shape[0]))])
    dark /= ink.sum()
    metre = frame.metre_from_pixel() @ (col, row, 1.0)
    np.testing.assert_allclose(pixels_from_metres(new, metre[None, :2])[0], dark, atol=0.05)


def test_walls_blocks_and_furniture_are_told_apart_and_a_door_is_found() -> None:
    left, right = box(0.0, 4.0, 4.0, 4.15), box(5.0, 4.0, 10.0, 4.15)
    table, shaft = box(1.0, 1.0, 2.4, 1.8), box(6.0, 5.0, 9.0, 8.0)
    found = find_structure(world(left, table, right, shaft))
    assert [each.tolist() for each in found.walls] == [left.tolist(), right.tolist()]
    assert [each.tolist() for each in found.furniture] == [table.tolist()]
    assert [each.tolist() for each in found.blocks] == [shaft.tolist()]
    (door,) = found.doors
    assert (door.x0, door.y0, door.x1, door.y1, door.along_x) == (4.0, 4.0, 5.0, 4.15, True)


@pytest.mark.parametrize("gap", [0.5, 2.0])
def test_a_gap_that_is_no_door_is_none(gap: float) -> None:
    assert find_structure(world(box(0.0, 4.0, 4.0, 4.15), box(4.0 + gap, 4.0, 10.0, 4.15))).doors == ()


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("seed", [1, 2])
def test_wall_faces_are_dark_where_the_pose_puts_them(style: str, seed: int) -> None:
    house = make_world("house", 5)
    plan = draft_plan(house, style, seed)
    faces = []
    for wall in find_structure(house).walls:
        (x0, y0), (x1, y1) = wall.min(axis=0), wall.max(axis=0)
        if x1 - x0 > 1.0 and y0 > 0.5 and y1 < house.size[1] - 0.5:
            faces += [(x, y) for x in np.arange(x0 + 0.3, x1 - 0.3, 0.05) for y in (y0, y1)]
    u, v = np.rint(pixels_from_metres(plan.frame, faces)).astype(int).T
    around = np.stack([plan.grey[v + dv, u + du] for dv in (-1, 0, 1) for du in (-1, 0, 1)])
    paper = np.median(plan.grey)
    assert np.mean(around.min(axis=0) < 0.75 * paper) > 0.93


def test_the_same_seed_gives_the_same_picture_and_another_one_does_not() -> None:
    house = make_world("house", 5)
    first, again, other = (draft_plan(house, "scanned", seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.grey, again.grey)
    assert first.frame == again.frame
    assert first.grey.shape != other.grey.shape or (first.grey != other.grey).any()


def test_only_scans_are_askew() -> None:
    for name in STYLES:
        turns = [draw_style(name, stream(seed, Role.DRAFTING)).turn for seed in range(8)]
        off = [abs(math.remainder(turn, math.pi / 2.0)) for turn in turns]
        assert (max(off) > 0.01) == (name == "scanned")


def test_an_unknown_style_is_refused_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"style is 'hollo', must be one of hollow, solid.*did you mean"):
        draft_plan(make_world("house", 5), "hollo", 1)
