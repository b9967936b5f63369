import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from merge.literature.chen2021.main_direction import main_direction, projected
from merge.literature.chen2021.wall_picture import straightened
from tests.merge.literature.chen2021.shapes import POLYGON, SIDE, filled, outline, rectangle, turned


def off_deg(angle, truth):
    """Between directions, which are the same when a quarter turn apart."""
    return abs((math.degrees(angle - truth) + 45.0) % 90.0 - 45.0)


TWO_STAIRS = math.asin(2 / 100)
"""Nearer to the axes a side of 100 pixels is drawn with one stair or none: other rectangles have the same picture."""


@settings(max_examples=25, deadline=None)
@given(
    angle=st.floats(TWO_STAIRS, math.pi / 2 - TWO_STAIRS),
    quarters=st.integers(0, 3),
    width=st.integers(100, 400),
    height=st.integers(100, 400),
)
def test_a_rectangles_direction_is_found_to_a_quarter_of_a_degree(angle, quarters, width, height):
    angle += quarters * math.pi / 2
    found = main_direction(outline(turned(rectangle(width, height), angle, 600), side=600))
    assert found.clear
    assert off_deg(found.angle, angle) <= 0.25
    assert abs(found.angle) <= math.pi / 4


@settings(max_examples=10, deadline=None)
@given(angle=st.floats(-TWO_STAIRS, TWO_STAIRS), width=st.integers(350, 400), height=st.integers(350, 400))
def test_near_the_axes_only_a_large_hall_gives_the_direction(angle, width, height):
    found = main_direction(outline(turned(rectangle(width, height), angle, 600), side=600))
    assert off_deg(found.angle, angle) <= 0.25


def test_small_rectangles_near_the_axes_have_the_raster_of_an_upright_one():
    """So no method can find their direction to a quarter of a degree."""
    turns = [outline(turned(rectangle(100, 100), math.radians(angle), 600), side=600) for angle in (-0.28, 0.0, 0.28)]
    assert all(np.array_equal(picture, turns[1]) for picture in turns)
    assert main_direction(turns[1]).angle == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.6, 1.2])
def test_a_thick_wall_is_not_mistaken_for_its_diagonal(angle):
    """The diagonal of a wall of 160 x 16 lies 5.7 degrees off its sides, and is where a single line meets most wall."""
    assert off_deg(main_direction(filled(turned(rectangle(160, 16), angle))).angle, angle) <= 0.25


def test_a_projection_by_hand():
    points = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    along_u, along_v = projected(points, np.array([0.0, math.pi / 2]))
    one, two = (0.25**2 + 0.5**2 + 0.25**2), (0.5**2 + 1.0 + 0.5**2)  # one or two points in a bin, smoothed
    assert along_u == pytest.approx(one + two)
    assert along_v == pytest.approx(one + two)


def test_the_fast_projections_are_those_of_a_slow_radon_transform():
    image = outline(turned(POLYGON, 0.3))
    rows, cols = np.nonzero(image)
    centred = np.stack((cols, rows), axis=-1) - np.array([cols.mean(), rows.mean()])
    angles = np.array([0.0, 0.29, 0.3, 0.31, 0.8])
    slow = []
    for angle in angles:
        place = centred[:, 1] * math.cos(angle) - centred[:, 0] * math.sin(angle)
        lower, share = np.floor(place).astype(int), place - np.floor(place)
        bins = np.zeros(600)
        np.add.at(bins, lower + 300, 1 - share)
        np.add.at(bins, lower + 301, share)
        slow.append((np.convolve(bins, [0.25, 0.5, 0.25], "same") ** 2).sum())
    assert np.allclose(projected(centred, angles), slow)
    assert np.argmax(slow) == 2


def test_halving_large_pictures_keeps_the_direction():
    large = outline(turned(5 * POLYGON, 0.4, 1500), 15, 1500)
    assert np.count_nonzero(large) > 40_000
    assert off_deg(main_direction(large).angle, 0.4) <= 0.25


def trapezoid():
    lean = 190 * math.tan(math.radians(9))
    return turned(np.array([(-95, -95), (95, -95), (95 - lean, 95), (lean - 95, 95)]), 0.0)


def circle():
    image = np.zeros((SIDE, SIDE), np.uint8)
    cv2.circle(image, (150, 150), 110, 255, 2)
    return image


def specks():
    return np.where(np.random.default_rng(3).random((SIDE, SIDE)) < 0.05, 255, 0).astype(np.uint8)


@pytest.mark.parametrize("shape", [trapezoid, circle, specks])
def test_a_building_without_a_main_direction_is_detected(shape):
    image = shape() if shape is not trapezoid else outline(trapezoid())
    assert not main_direction(image).clear


def test_a_blank_picture_has_no_direction():
    found = main_direction(np.zeros((40, 50), np.uint8))
    assert (found.angle, found.sharpness, found.clear) == (0.0, 0.0, False)


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.9, 1.5])
def test_a_straightened_rectangle_has_its_sides_along_rows_and_columns(angle):
    corners = turned(rectangle(180, 90), angle)
    walls = straightened(outline(corners), angle, 16)
    rows, cols = np.nonzero(walls.walls)
    there = corners @ walls.matrix[:, :2].T + walls.matrix[:, 2]
    assert np.allclose(
        [cols.min(), rows.min(), cols.max(), rows.max()], [*there.min(0), *there.max(0)], atol=2.5
    )  # half a wall, and half a pixel
    assert np.ptp(cols) == pytest.approx(183, abs=2)
    assert np.ptp(rows) == pytest.approx(93, abs=2)
    assert walls.before(there) == pytest.approx(corners)


def test_the_rotated_picture_is_complete():
    image = np.zeros((60, 200), np.uint8)
    image[[1, 1, -2, -2], [1, -2, 1, -2]] = 255
    spots = cv2.dilate(image, np.ones((3, 3), np.uint8))
    assert cv2.connectedComponents(straightened(spots, 0.5, 16).walls)[0] == 1 + 4
