import cv2
import numpy as np
import pytest

from merge.literature.chen2021.interest_points import dilated, interest_points, point_picture, tile_half
from merge.literature.chen2021.main_structure import corners, main_structure
from merge.literature.chen2021.wall_picture import binarised, closed, closing_side, run_lengths, wall_thickness
from merge.preparation.map_image import UNKNOWN_GREY
from tests.merge.literature.chen2021.shapes import POLYGON, SIDE, outline, turned


def bar(thick, horizontal=True):
    """A wall of 200 pixels whose middle is at 150, or half a pixel above."""
    image = np.zeros((SIDE, SIDE), np.uint8)
    low = 150 - thick // 2
    image[low : low + thick, 50:250] = 255
    return image if horizontal else np.ascontiguousarray(image.T)


def structure_of(image, half=None):
    half = tile_half(wall_thickness(image, 3, 0.9).thick) if half is None else half
    return main_structure(dilated(image, half), interest_points(image, half), half), half


def test_walls_are_darker_than_unknown():
    assert binarised(np.array([[0, 100, 127, 128, 205, 255]], np.uint8), UNKNOWN_GREY).tolist() == [
        [255, 255, 255, 0, 0, 0]
    ]


@pytest.mark.parametrize("thick", [1, 2, 3, 4, 5, 8])
def test_thickness_is_independent_of_the_direction_of_the_wall(thick):
    for horizontal in (True, False):
        found = wall_thickness(bar(thick, horizontal), 3, 0.9)
        assert (found.usual, found.thick) == (thick, thick)


def test_thickness_separates_usual_from_thick_walls():
    image = bar(2)
    image[20:26, 50:110] = 255
    found = wall_thickness(image, 3, 0.9)
    assert (found.usual, found.thick) == (2, 6)
    assert wall_thickness(np.zeros((9, 9), np.uint8), 3, 0.9).thick == 1


def test_run_lengths_by_hand():
    image = np.array([[255, 255, 0, 255], [0, 0, 0, 0], [255, 255, 255, 255]], np.uint8)
    assert run_lengths(image).tolist() == [[2, 2, 0, 1], [0, 0, 0, 0], [4, 4, 4, 4]]


@pytest.mark.parametrize("thick", [1, 2, 5])
def test_closing_bridges_gaps_narrower_than_its_side_and_no_others(thick):
    side = closing_side(thick)
    for gap in (side - 1, side):
        image = bar(thick)
        image[:, 140 : 140 + gap] = 0
        assert (closed(image, side)[150, 140 : 140 + gap] > 0).all() == (gap < side)


def test_closing_is_extensive_and_clean_at_the_border():
    image = np.zeros((20, 20), np.uint8)
    image[0, 3] = image[1, 12] = 255
    assert np.array_equal(closed(image, 5), image)


@pytest.mark.parametrize("thick", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("horizontal", [True, False])
def test_points_of_a_thick_wall_lie_on_its_centre_line_a_tile_apart(thick, horizontal):
    half = tile_half(thick)
    points = interest_points(bar(thick, horizontal), half)
    along, across = points[:, ::1].T if horizontal else points[:, ::-1].T
    middle = 150 - thick // 2 + (thick - 1) / 2
    assert np.abs(across - middle).max() <= 0.5
    steps = np.diff(np.sort(along))
    assert len(points) == pytest.approx(200 / (2 * half + 1), abs=2)
    assert np.median(steps) == 2 * half + 1
    assert steps.max() <= 2 * (2 * half + 1)


def test_tiles_equal_those_of_a_slow_scan():
    rng = np.random.default_rng(1)
    image = cv2.dilate(np.where(rng.random((60, 70)) < 0.03, 255, 0).astype(np.uint8), np.ones((2, 5), np.uint8))
    half, left, slow = 1, np.pad(dilated(image, 1), 0).copy(), 0
    for row in range(half, 60 - half):
        for col in range(half, 70 - half):
            window = left[row - 1 : row + 2, col - 1 : col + 2]
            if window.all():
                window[:] = 0
                slow += 1
    points = interest_points(image, half)
    assert 0 < len(points) <= slow
    assert len(points) >= 0.8 * slow  # two tiles may share the middle of one run
    assert image[points[:, 1], points[:, 0]].all()
    assert np.array_equal(points, points[np.lexsort((points[:, 0], points[:, 1]))])
    assert np.count_nonzero(point_picture(points, image.shape)) == len(points)


@pytest.mark.parametrize("thick", [1, 4, 7])
def test_a_thick_wall_becomes_one_straight_line_of_one_pixel(thick):
    for horizontal in (True, False):
        structure, half = structure_of(bar(thick, horizontal))
        lines = structure if horizontal else structure.T
        rows, cols = np.nonzero(lines)
        assert len(set(rows.tolist())) == 1
        assert abs(rows[0] - 150) <= 1
        assert cols.min() <= 50 + 2 * half + 1
        assert cols.max() >= 249 - 2 * (2 * half + 1)
        assert len(cols) == cols.max() - cols.min() + 1


def test_a_pillar_becomes_a_small_square():
    image = np.zeros((SIDE, SIDE), np.uint8)
    image[99:102, 199:202] = 255
    structure, half = structure_of(image)
    rows, cols = np.nonzero(structure)
    assert (rows.min(), rows.max(), cols.min(), cols.max()) == (100 - half, 100 + half, 200 - half, 200 + half)
    assert structure[100, 200] == 0


@pytest.mark.parametrize("thick", [2, 4])
def test_the_structure_of_a_room_runs_along_rows_and_columns_on_its_walls(thick):
    image = outline(turned(POLYGON, 0.0), thick)
    structure, half = structure_of(image)
    assert not structure[dilated(image, half) == 0].any()
    for k in range(len(POLYGON)):  # every wall is there but for its ends
        a, b = turned(POLYGON, 0.0)[k], turned(POLYGON, 0.0)[(k + 1) % len(POLYGON)]
        inner = a + np.linspace(0.25, 0.75, 40)[:, None] * (b - a)
        near = cv2.dilate(structure, np.ones((2 * thick + 1, 2 * thick + 1), np.uint8))
        seen = near[inner[:, 1].round().astype(int), inner[:, 0].round().astype(int)]
        assert (seen > 0).mean() > 0.9


def test_slanted_lines_are_only_drawn_without_a_main_direction():
    image = np.zeros((SIDE, SIDE), np.uint8)
    cv2.line(image, (50, 60), (240, 230), 255, 2)
    points = interest_points(image, 1)
    slanted, straight = (main_structure(dilated(image, 1), points, 1, along_axes) for along_axes in (False, True))
    for drawn in (slanted, straight):
        assert not drawn[dilated(image, 1) == 0].any()
        assert cv2.connectedComponents(drawn)[0] == 1 + 1
    assert run_lengths(slanted).max() < run_lengths(straight).max()


def test_the_corners_of_a_known_polygon_are_found_and_few_others():
    image = outline(turned(POLYGON, 0.0))
    structure, half = structure_of(image)
    found, truth = corners(structure, half), turned(POLYGON, 0.0)
    nearest = np.hypot(*(found[:, None] - truth[None]).T).T  # (found, truth)
    assert nearest.min(axis=0).max() <= 3.0
    assert len(found) <= len(truth) + 2


def test_an_l_has_a_corner_at_its_bend_and_one_at_each_end():
    image = np.zeros((SIDE, SIDE), np.uint8)
    image[100:102, 80:220] = 255
    image[100:220, 80:82] = 255
    found = corners(*structure_of(image))
    for place in ((80.5, 100.5), (219.0, 100.5), (80.5, 219.0)):
        assert np.hypot(*(found - place).T).min() <= 4.0
    assert len(found) == 3


def test_every_step_accepts_a_blank_picture():
    blank = np.zeros((30, 40), np.uint8)
    structure, half = structure_of(blank)
    assert not structure.any()
    assert corners(structure, half).shape == (0, 2)
