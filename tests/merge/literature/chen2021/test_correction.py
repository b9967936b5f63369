from typing import get_args

import numpy as np
import pytest

from merge.literature.chen2021.correction import CorrectionSettings, Step, corrected
from merge.preparation.map_image import FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY
from tests.merge.literature.chen2021.shapes import POLYGON, SIDE, outline, turned


def grey(walls):
    return np.where(walls > 0, OCCUPIED_GREY, FREE_GREY).astype(np.uint8)


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0.0, 0.15, 0.7, 1.3, 2.9])
def test_corners_of_a_rotated_room_are_in_coordinates_of_the_input(angle):
    truth = turned(POLYGON, angle)
    found = corrected(grey(outline(truth)))
    there = found.straightened.before(found.corners)
    assert np.hypot(*(there[:, None] - truth[None]).T).min(axis=1).max() <= 6.0  # two tiles
    assert found.note is None


def test_sizes_follow_from_the_walls_thickness():
    thin, thick = (corrected(grey(outline(turned(POLYGON, 0.3), width))) for width in (1, 7))
    assert (thin.half, thin.closing) == (1, 3)
    assert thick.half >= 3
    assert thick.closing > thin.closing


def test_pictures_of_a_correction_have_one_size_after_the_rotation():
    found = corrected(grey(outline(turned(POLYGON, 0.3))))
    assert found.walls.shape == (SIDE, SIDE)
    assert found.straightened.walls.shape == found.closed.shape == found.structure.shape
    assert found.closed.shape != found.walls.shape
    assert set(np.unique(found.structure)) == {0, 255}


def test_a_round_room_is_not_rotated_and_gives_a_note():
    circle = np.stack((np.cos(np.linspace(0, 2 * np.pi, 200)), np.sin(np.linspace(0, 2 * np.pi, 200))), axis=-1)
    found = corrected(grey(outline(100 * circle + 150)))
    assert np.array_equal(found.straightened.matrix[:, :2], np.eye(2))
    assert found.note.startswith("no main direction (sharpness 0.")


def test_a_blank_map_is_accepted():
    found = corrected(np.full((20, 30), FREE_GREY, np.uint8))
    assert len(found.corners) == len(found.points) == 0


def test_a_step_that_is_left_out_does_nothing():
    """Known answers: each step's own trace is missing, and the steps before it are unchanged."""
    picture = grey(outline(turned(POLYGON, 0.3), 5))
    picture[:40, :40] = UNKNOWN_GREY
    full = corrected(picture)
    found = {step: corrected(picture, CorrectionSettings(without=step)) for step in get_args(Step)}
    assert np.array_equal(found["binarise"].walls > 0, picture <= UNKNOWN_GREY)
    assert np.array_equal(found["rotate"].straightened.matrix[:, :2], np.eye(2))
    assert found["rotate"].direction.angle == full.direction.angle
    assert np.array_equal(found["close"].closed, full.straightened.walls)
    assert len(found["sample"].points) > 4 * len(full.points)
    assert np.array_equal(found["straighten"].structure, full.closed)
    assert np.array_equal(found["straighten"].points, full.points)
