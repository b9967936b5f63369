"""Pairs with one right answer or several: rooms whose symmetry is known."""

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import identifiability

SHAPE = (280, 400)
FRAME = GridFrame(0.05, SE2(), SHAPE)


def world(*rooms, boxes=()):
    """Rooms (row, col, rows, cols) with walls of three cells, and boxes in them, in metres of 20 cells."""
    log_odds = np.zeros(SHAPE, np.float32)
    for row, col, rows, cols in rooms:
        log_odds[20 * row - 3 : 20 * (row + rows) + 3, 20 * col - 3 : 20 * (col + cols) + 3] = 1.0
    for row, col, rows, cols in rooms:
        log_odds[20 * row : 20 * (row + rows), 20 * col : 20 * (col + cols)] = -1.0
    for row, col, rows, cols in boxes:
        log_odds[20 * row : 20 * (row + rows), 20 * col : 20 * (col + cols)] = 1.0
    return OccupancyGrid(FRAME, log_odds)


def part(grid, low, high):
    """The columns [low, high) in metres; nothing else was seen."""
    log_odds = grid.log_odds.copy()
    log_odds[:, : 20 * low] = log_odds[:, 20 * high :] = 0.0
    return OccupancyGrid(FRAME, log_odds)


CLUTTER = ((3, 3, 1, 2), (6, 7, 2, 1), (4, 11, 1, 1), (8, 13, 1, 2), (3, 16, 2, 1))


def test_a_room_without_symmetry_has_one_answer():
    room = world((2, 2, 8, 16), boxes=CLUTTER)
    found = identifiability(part(room, 1, 13), part(room, 6, 19))
    assert found.identifiable
    assert found.score > 0.6


def test_a_bare_room_is_ambiguous_by_half_a_turn():
    room = world((2, 2, 8, 16))
    found = identifiability(room, room)
    assert found.score > 0.95
    assert found.second_best > 0.9
    assert not found.identifiable


def test_a_bare_corridor_is_ambiguous_along_its_walls():
    corridor = world((4, 1, 2, 18))
    assert not identifiability(part(corridor, 3, 12), part(corridor, 6, 15)).identifiable


def test_two_equal_rooms_are_ambiguous():
    boxes = ((3, 3, 1, 2), (6, 5, 2, 1))
    twins = world((2, 2, 8, 6), (2, 11, 8, 6), boxes=boxes + tuple((r, c + 9, h, w) for r, c, h, w in boxes))
    left, right = part(twins, 1, 10), part(twins, 10, 19)
    assert identifiability(left, left).identifiable
    assert not identifiability(left, right).identifiable
    assert not identifiability(twins, left).identifiable


def test_robots_without_common_ground_have_no_answer():
    room = world((2, 2, 8, 16), boxes=CLUTTER)
    found = identifiability(part(room, 1, 8), part(room, 11, 19))
    assert not found.identifiable


def test_order_does_not_matter_much():
    room = world((2, 2, 8, 16), boxes=CLUTTER)
    there, back = (identifiability(*pair) for pair in ((part(room, 1, 13), room), (room, part(room, 1, 13))))
    assert there.score == pytest.approx(back.score, abs=0.02)
    assert there.second_best == pytest.approx(back.second_best, abs=0.08)


def test_a_blank_footprint_is_never_identifiable():
    blank = OccupancyGrid(FRAME, np.zeros(SHAPE, np.float32))
    assert not identifiability(blank, world((2, 2, 8, 16))).identifiable


def test_rasters_of_two_frames_are_refused():
    other = OccupancyGrid(GridFrame(0.05, SE2(), (3, 3)), np.zeros((3, 3), np.float32))
    with pytest.raises(ValueError, match="one frame"):
        identifiability(other, world((2, 2, 8, 16)))
