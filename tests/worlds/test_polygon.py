"""Polygons: known answers and refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from worlds.polygon import box, contains, disc, distances, edges, is_simple, signed_area, turned_box

L_SHAPE = np.array([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)], dtype=float)


def test_an_l_contains_its_arms_and_not_its_notch() -> None:
    points = [(0.5, 0.5), (2.5, 0.5), (0.5, 1.5), (2.0, 1.5), (-0.5, 0.5), (3.5, 0.5), (0.5, 2.5)]
    assert contains(L_SHAPE, points).tolist() == [True, True, True, False, False, False, False]


@pytest.mark.parametrize("polygon", [box(3, 4, 1, 2), turned_box(5, 5, 2, 1, 0.7), disc(1, 1, 0.5), L_SHAPE])
def test_shapes_are_simple_and_counter_clockwise(polygon: np.ndarray) -> None:
    assert signed_area(polygon) > 0.0
    assert is_simple(polygon)


def test_a_rotated_box_has_its_length_along_its_yaw() -> None:
    polygon = turned_box(1.0, 2.0, 4.0, 1.0, math.pi / 6)
    assert contains(polygon, [(1.0 + 1.9 * math.cos(math.pi / 6), 2.0 + 1.9 * math.sin(math.pi / 6))]).all()
    assert signed_area(polygon) == pytest.approx(4.0)


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (2, 2), (2, 0), (0, 2)],
        [(0, 0), (4, 0), (4, 2), (2, 0), (0, 2)],
        [(0, 0), (4, 0), (4, 1), (1, 1), (3, 1), (3, 3), (0, 3)],
        [(0, 0), (0, 0), (1, 0), (1, 1)],
    ],
    ids=["bow tie", "corner on a side", "sides on one another", "doubled corner"],
)
def test_crossing_and_touching_polygons_are_not_simple(corners: list[tuple[float, float]]) -> None:
    assert not is_simple(np.array(corners, dtype=float))


def test_distance_to_a_side_and_to_a_corner() -> None:
    points = [(2.0, -1.5), (4.0, 2.0), (2.0, 3.0)]
    assert distances(edges(L_SHAPE), points) == pytest.approx([1.5, math.sqrt(2.0), math.sqrt(2.0)])
