"""Walls of drawn plans: filled whatever the style, without what is drawn beside them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from worlds.drafting.drafting import DraftedPlan, draft_plan
from worlds.drafting.sheet import pixels_from_metres
from worlds.drafting.structure import find_structure
from worlds.drafting.style import STYLES
from worlds.families.registry import make_world
from worlds.importing import strokes
from worlds.importing.drawn_walls import DrawnWalls, find_walls, plan_grid
from worlds.importing.ink import find_ink, ink_pixels

OUTER, INNER = ((60, 60), (540, 440)), ((300, 60), (300, 250))
THICK = 10


def structure() -> np.ndarray:
    """Two rooms: outer walls and a wall between, of 10 pixels."""
    solid = np.zeros((500, 600), np.uint8)
    cv2.rectangle(solid, *OUTER, 1, THICK)
    cv2.line(solid, *INNER, 1, THICK)
    return solid


def drawing(style: str) -> np.ndarray:
    """The walls of ``structure``, solid, hollow or hatched, with a door, dimensions, a word and a frame."""
    solid = structure()
    grey = np.full(solid.shape, 255, np.uint8)
    if style == "solid":
        grey[solid > 0] = 0
    else:
        grey[(solid > 0) & (cv2.erode(solid, np.ones((3, 3), np.uint8)) == 0)] = 0
    if style == "hatched":
        rows, cols = np.indices(solid.shape)
        grey[(solid > 0) & ((rows + cols) % 6 == 0)] = 0
    cv2.ellipse(grey, (305, 340), (60, 60), 0, 0, 90, 0, 1)
    cv2.line(grey, (305, 340), (305, 400), 0, 1)
    cv2.line(grey, (60, 470), (540, 470), 0, 1)
    cv2.rectangle(grey, (380, 120), (440, 180), 0, 1)
    cv2.putText(grey, "Kitchen", (110, 200), cv2.FONT_HERSHEY_SIMPLEX, 0.7, 0, 1)
    cv2.rectangle(grey, (8, 8), (591, 491), 0, 2)
    return grey


@pytest.mark.parametrize("style", ["solid", "hollow", "hatched"])
@pytest.mark.parametrize("inverted", [False, True])
def test_walls_are_filled_and_all_else_is_dropped(style: str, inverted: bool) -> None:
    grey = drawing(style)
    walls = find_walls(255 - grey if inverted else grey)
    solid = structure() > 0
    near = cv2.dilate(structure(), np.ones((7, 7), np.uint8)) > 0
    assert (walls.wall & solid).sum() > 0.97 * solid.sum()
    assert not (walls.wall & ~near).any()
    assert abs(walls.thickness - THICK) <= 2
    assert walls.inside[250, 200]
    assert walls.inside[250, 400]
    assert not walls.inside[470, 300]
    assert not walls.inside[20, 20]


@settings(max_examples=8, deadline=None)
@given(turns=st.integers(0, 3), mirrored=st.booleans())
def test_turning_the_sheet_turns_the_walls(turns: int, mirrored: bool) -> None:
    grey = drawing("hollow")

    def moved(picture: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(np.rot90(picture[:, ::-1] if mirrored else picture, turns))

    expected, found = moved(find_walls(grey).wall), find_walls(moved(grey)).wall
    assert (expected ^ found).sum() < 0.02 * expected.sum()


def _recall_and_precision(plan: DraftedPlan, walls: DrawnWalls, name: str, seed: int) -> tuple[float, float]:
    """Share of the true walls' middle lines that were found, and of the walls found that are near a true one."""
    middles = []
    for wall in find_structure(make_world(name, seed)).walls:
        low, high = wall.min(axis=0), wall.max(axis=0)
        along = int(high[1] - low[1] > high[0] - low[0])
        steps = np.arange(low[along] + 0.1, high[along] - 0.1, 0.05)
        points = np.tile((low + high) / 2.0, (len(steps), 1))
        points[:, along] = steps
        middles.append(points)
    u, v = np.rint(pixels_from_metres(plan.frame, np.concatenate(middles))).astype(int).T
    true = np.zeros(walls.wall.shape, np.uint8)
    true[v, u] = 1
    found = strokes.distance_to(walls.wall.astype(np.uint8))[v, u] <= 2.0
    near = strokes.distance_to(true)[walls.wall] <= 0.6 / plan.frame.resolution
    return float(np.mean(found)), float(np.mean(near))


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("seed", [4, 5])
def test_walls_of_drafted_houses_are_found(style: str, seed: int) -> None:
    plan = draft_plan(make_world("house", seed), style, 10 + seed)
    recall, precision = _recall_and_precision(plan, find_walls(plan.grey), "house", seed)
    assert recall > 0.95
    assert precision > 0.8


def test_a_plan_of_single_lines_keeps_them_as_walls() -> None:
    grey = np.full((300, 400), 255, np.uint8)
    cv2.rectangle(grey, (50, 50), (350, 250), 0, 2)
    cv2.line(grey, (200, 50), (200, 180), 0, 2)
    walls = find_walls(grey)
    assert walls.wall[50, 100]
    assert walls.wall[150, 200]
    assert walls.inside[150, 100]


def test_a_frame_is_dropped_and_a_lone_outer_wall_of_two_lines_is_not() -> None:
    grey = np.full((300, 400), 255, np.uint8)
    cv2.rectangle(grey, (60, 60), (340, 240), 0, 1)
    cv2.rectangle(grey, (68, 68), (332, 232), 0, 1)
    assert find_ink(grey)[60, 100] == 1
    cv2.rectangle(grey, (10, 10), (390, 290), 0, 2)
    ink = find_ink(grey)
    assert not ink[10].any()
    assert ink[60, 100] == 1


def test_half_tones_are_ink_where_they_fill_but_not_as_the_edge_of_a_line() -> None:
    grey = np.full((200, 200), 250, np.uint8)
    grey[50:60, 20:180] = 120
    grey[100:102, 20:180] = 0
    grey[99, 20:180] = grey[102, 20:180] = 160
    ink = ink_pixels(grey)
    assert ink[50:60, 20:180].all()
    assert ink[100:102, 20:180].all()
    assert not ink[99].any()


def test_the_grid_has_the_lower_left_corner_of_the_picture_whatever_the_cells() -> None:
    walls = find_walls(drawing("solid"))
    for cells in (THICK, 3.0, 1.0):
        grid = plan_grid(walls, 0.02, cells)
        corner = grid.frame.cells_from_metres([(60 * 0.02, (500 - 250) * 0.02)])[0]
        assert grid.occupancy()[tuple(corner)] == OCCUPIED
        room = grid.frame.cells_from_metres([(200 * 0.02, (500 - 250) * 0.02)])[0]
        assert grid.occupancy()[tuple(room)] == FREE
        assert grid.occupancy()[0, 0] == UNKNOWN


@pytest.mark.parametrize(
    ("grey", "message"),
    [
        (np.full((200, 200), 255, np.uint8), "nothing is drawn"),
        (np.full((20, 200), 255, np.uint8), "has 200 x 20 pixels, a plan needs 64 a side"),
    ],
)
def test_a_picture_without_a_plan_is_refused(grey: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        find_walls(grey)


@given(width=st.integers(2, 12), gap=st.integers(2, 20))
def test_gaps_close_up_to_their_width_and_nothing_grows(width: int, gap: int) -> None:
    mask = np.zeros((80, 60), np.uint8)
    mask[20 : 20 + width] = mask[20 + width + gap : 20 + 2 * width + gap] = 1
    distance = strokes.distance_to(mask)
    closed, open_ = (strokes.gaps_closed(distance, each)[:, 30] for each in (gap + 2, gap - 1))
    assert closed[20 : 20 + 2 * width + gap].all()
    assert closed.sum() == 2 * width + gap
    assert open_.sum() == 2 * width


def test_thin_lines_that_noise_breaks_hold_together() -> None:
    grey = np.full((200, 300), 220.0)
    grey[100, 20:280] = 110.0
    noisy = grey + np.random.default_rng(3).normal(0.0, 8.0, grey.shape)
    noisy[100, 60:240:9] += 35.0
    noisy[40:60, 40:60] = 125.0
    count, _ = cv2.connectedComponents(find_ink(np.clip(noisy, 0, 255).astype(np.uint8)), connectivity=8)
    assert count == 3


def test_thinner_walls_of_a_plan_without_thin_lines_are_kept() -> None:
    grey = np.full((500, 600), 255, np.uint8)
    cv2.rectangle(grey, *OUTER, 0, 14)
    for x in range(100, 520, 40):
        cv2.line(grey, (x, 60), (x, 300), 0, 5)
    walls = find_walls(grey)
    assert all(walls.wall[200, x] for x in range(100, 520, 40))


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), lines=st.integers(0, 12), noise=st.sampled_from([0.0, 5.0, 60.0]))
def test_any_picture_gives_walls_or_a_refusal(seed: int, lines: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    grey = np.full(rng.integers(64, 200, 2), rng.integers(0, 256), np.uint8)
    for _ in range(lines):
        start, end = rng.integers(-20, 220, (2, 2)).tolist()
        cv2.line(grey, start, end, int(rng.integers(0, 256)), int(rng.integers(1, 30)))
    grey = np.clip(grey + rng.normal(0.0, noise, grey.shape), 0, 255).astype(np.uint8)
    try:
        walls = find_walls(grey)
    except ValueError as error:
        assert str(error) in (
            "nothing is drawn in the picture",
            "no lines of the picture hang together as walls do; is it a floor plan?",
        )
        return
    assert walls.wall.any()
    assert not (walls.wall & ~walls.inside).any()
    assert not (walls.wall & walls.unclear).any()
