import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment.patchwise_alignment import align_patchwise
from merge.alignment.settings import AlignmentSettings, PatchwiseSettings
from merge.preparation.prepared_map import PreparedMap
from tests.merge.rooms import observed, rooms, viewpoints


@pytest.fixture(scope="module")
def grid():
    rng = np.random.default_rng(5)
    world = rooms(rng)
    return observed(world, viewpoints(world, rng, (0.3, 0.3), (15.7, 10.7), 40), Similarity2(), rng)


def bent_by(grid, sagitta):
    """The map, 12 cells wider on each side, its rows shifted along an arc by up to ``sagitta`` cells, mean nought."""
    values = np.pad(grid.log_odds, ((0, 0), (12, 12)))
    shift = np.rint(sagitta * (np.linspace(-1, 1, len(values)) ** 2 - 1 / 3)).astype(int)
    values = np.stack([np.roll(row, by) for row, by in zip(values, shift, strict=True)])
    return OccupancyGrid(GridFrame(grid.frame.resolution, grid.frame.origin, values.shape), values)


@pytest.mark.slow
def test_a_distorted_map_is_aligned_by_the_mean_of_its_patches(grid):
    target, source = PreparedMap(bent_by(grid, 9.0)), PreparedMap(grid)
    truth, start = Similarity2(12.0), Similarity2(9.0, 2.0, math.radians(0.7))
    found = align_patchwise(
        target, source, start, ScaleRange.known(), AlignmentSettings(patchwise=PatchwiseSettings(rounds=4))
    )

    def off(answer):
        return np.hypot(*(answer.apply(source.points) - truth.apply(source.points)).T).mean()

    assert off(start) > 3.0
    assert off(found) < 1.5


def test_a_map_on_itself_is_not_moved(grid):
    prepared = PreparedMap(grid)
    found = align_patchwise(prepared, prepared, Similarity2(), ScaleRange.free())
    assert np.abs(found.matrix() - Similarity2().matrix()).max() < 1e-9


def test_without_correspondences_the_answer_is_returned(grid):
    prepared, far = PreparedMap(grid), Similarity2(5000.0)
    assert align_patchwise(prepared, prepared, far, ScaleRange.known()) == far
