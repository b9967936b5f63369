import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.chen2021.wall_icp import IcpSettings, WallCells, icp
from tests.merge.literature.crisp import blank, crisp_pair, off_share


@pytest.fixture(scope="module")
def pair():
    target, source, truth = crisp_pair()
    return WallCells.of(target.grid, 10), WallCells.of(source.grid, 10), truth, source


@pytest.mark.parametrize("shift", [(4.0, -3.0, 0.0), (-3.0, 2.0, 0.02), (0.0, 0.0, -0.03)])
def test_a_start_some_cells_off_converges_to_the_truth(pair, shift):
    target, source, truth, prepared = pair
    found = icp(target, source, Similarity2(*shift) @ truth, ScaleRange.known())
    assert off_share(found, truth, prepared) < 0.004
    assert found.scale == 1.0


def test_a_free_scale_converges_too(pair):
    target, source, truth, prepared = pair
    middle = Similarity2(*source.points.mean(axis=0))
    larger = middle @ Similarity2(0.0, 0.0, 0.0, 1.01) @ middle.inverse()
    found = icp(target, source, truth @ larger, ScaleRange.free())
    assert found.scale == pytest.approx(1.0, abs=2e-3)
    assert off_share(found, truth, prepared) < 0.004


def test_swapped_maps_converge_to_the_inverse(pair):
    target, source, truth, prepared = pair
    back = icp(source, target, truth.inverse(), ScaleRange.known())
    assert off_share(back.inverse(), truth, prepared) < 0.004


def test_a_start_without_correspondences_is_returned(pair):
    target, source, _, _ = pair
    away = Similarity2(1e5, 0.0)
    assert icp(target, source, away, ScaleRange.known()) == away
    bare = WallCells.of(blank().grid, 10)
    assert icp(bare, source, away, ScaleRange.known()) == away
    assert icp(target, bare, away, ScaleRange.known()) == away


def test_the_nearest_wall_equals_that_of_a_search(pair):
    target = pair[0]
    points = np.random.default_rng(0).uniform(0, 150, (200, 2))
    partners, near = target.partners(points, 8.0)
    slow = np.hypot(*(points[:, None] - target.points[None]).T).min(axis=0)
    fast = np.hypot(*(partners - points).T)
    assert np.array_equal(near, fast <= 8.0)
    assert (fast - slow).max() <= 1.5  # looked up by the cell that a point lies in
    assert near[slow < 6.0].all()


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match="gate_cells is -1"):
        IcpSettings(gate_cells=-1)
