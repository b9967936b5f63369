"""Worlds: refusals, and distances to obstacles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from worlds.polygon import box
from worlds.world import World


def test_clearance_is_zero_inside_and_exact_outside() -> None:
    world = World("one box", 0, (10, 10), (box(4, 4, 6, 6),))
    points = [(5.0, 5.0), (4.01, 4.01), (2.0, 5.0), (7.0, 7.0)]
    assert world.clearance(points) == pytest.approx([0.0, 0.0, 2.0, math.sqrt(2.0)])


def test_an_empty_world_has_infinite_clearance() -> None:
    world = World("nothing", 0, (1, 1), ())
    assert world.segments().shape == (0, 2, 2)
    assert world.clearance([(0.5, 0.5)]).tolist() == [math.inf]


def test_segments_close_every_polygon() -> None:
    segments = World("two", 0, (9, 9), (box(1, 1, 2, 2), box(3, 3, 5, 4))).segments()
    assert segments.shape == (8, 2, 2)
    for polygon in (segments[:4], segments[4:]):
        assert np.array_equal(polygon[:, 1], np.roll(polygon[:, 0], -1, axis=0))


def test_obstacles_are_read_only_copies() -> None:
    corners = np.array([(1, 1), (2, 1), (2, 2)], dtype=float)
    world = World("copy", 0, (3, 3), (corners,))
    corners[0] = 9.0
    assert world.obstacles[0][0].tolist() == [1.0, 1.0]
    with pytest.raises(ValueError, match="read-only"):
        world.obstacles[0][0] = 0.0


@pytest.mark.parametrize(
    ("size", "corners", "message"),
    [
        ((0, 5), [(1, 1), (2, 1), (2, 2)], "width is 0.0"),
        ((5, math.nan), [(1, 1), (2, 1), (2, 2)], "height is nan"),
        ((5, 5), [(1, 1), (2, 2), (2, 1)], "counter-clockwise"),
        ((5, 5), [(1, 1), (2, 1)], "three corners"),
        ((5, 5), [(1, 1), (6, 1), (2, 2)], "leaves the world"),
        ((5, 5), [(1, 1), (math.inf, 1), (2, 2)], "not finite"),
        ((5, 5), [(0, 0), (4, 0), (4, 2), (2, 0), (0, 2)], "touches itself"),
    ],
)
def test_bad_worlds_are_refused_by_name(
    size: tuple[float, float], corners: list[tuple[float, float]], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        World("bad", 0, size, (np.array(corners, dtype=float),))
