import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.correlation import CorrelationSettings, correlate
from tests.merge.rooms import rooms


def prepare(values):
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values))


@pytest.fixture(scope="module")
def world():
    return np.where(rooms(np.random.default_rng(11)).walls, 100, 0)


def test_a_cropped_map_is_found_at_its_position(world):
    target, piece = prepare(world), prepare(world[60:200, 100:280])
    best = correlate(target.layers, piece.layers, 1.0, [0.0])[0].target_from_source
    assert (best.x, best.y) == pytest.approx((100.0, 60.0), abs=3.0)  # a cell of the raster is 2.9 cells wide


def test_a_rotated_and_scaled_crop_is_found_only_at_its_rotation_and_scale(world):
    piece = np.rot90(np.kron(world, np.ones((2, 2), dtype=int))[120:400, 200:560], -1)  # rows up: turned by +90
    target, source = prepare(world), prepare(piece)
    truth = Similarity2(100.0, 60.0 + 140.0, -math.pi / 2, 0.5)
    score = {}
    for yaw in (-math.pi / 2, 0.0, math.pi / 2, math.pi):
        for scale in (0.5, 0.6):
            peak = correlate(target.layers, source.layers, scale, [yaw])[0]
            score[yaw, scale] = peak.score
            if (yaw, scale) == (-math.pi / 2, 0.5):
                assert np.abs(peak.target_from_source.apply(source.points) - truth.apply(source.points)).max() < 4.0
    assert max(score, key=score.get) == (-math.pi / 2, 0.5)


def faced(side):
    """A wall with a step, free on the side (+1 above, -1 below) that it is seen from, unknown beyond."""
    values = np.full((80, 120), -1)
    height = np.where(np.arange(120) < 50, 38, 46)
    for col, row in enumerate(height):
        values[row : row + 2, col] = 100
        free = slice(row + 2, row + 26) if side > 0 else slice(row - 24, row)
        values[free, col] = 0
    return values


def test_the_side_of_a_wall_counts():
    above, below = prepare(faced(1)), prepare(faced(-1))
    same = correlate(above.layers, above.layers, 1.0, [0.0])[0]
    other = correlate(above.layers, below.layers, 1.0, [0.0], CorrelationSettings(peaks=50))
    assert near_nought(same)
    assert max((peak.score for peak in other if near_nought(peak)), default=0.0) < 0.2 * same.score


def near_nought(peak):
    return math.hypot(peak.target_from_source.x, peak.target_from_source.y) < 4.0


def test_blank_maps_have_no_correlation():
    blank = prepare(np.full((30, 40), -1))
    assert all(peak.score == 0.0 for peak in correlate(blank.layers, blank.layers, 1.0, [0.0]))
