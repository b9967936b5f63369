import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.proposers.normal_correlation import NormalCorrelation, WallRasters, scales
from tests.merge.rooms import cave, rooms, two_prepared_maps

RNG = np.random.default_rng(0)


def nearest(proposals, truth, source):
    """How far the nearest proposal puts the source's surface from the truth, as a share of its diagonal."""
    off = [
        np.hypot(*(p.target_from_source.apply(source.points) - truth.apply(source.points)).T).mean() for p in proposals
    ]
    return min(off) / (truth.scale * source.diagonal)


@pytest.mark.parametrize("build", [rooms, cave])
@pytest.mark.parametrize("known", [True, False], ids=["known", "free"])
def test_correlation_alone_proposes_the_truth_with_scale_known_or_free(build, known):
    target, source, truth = two_prepared_maps(build, 2, Similarity2(3.0, 1.0, -0.7, 1.0 if known else 1.4))
    method = NormalCorrelation()
    scale = ScaleRange.known() if known else ScaleRange.free()
    proposals = method.propose(method.describe(target), method.describe(source), scale, RNG)
    assert nearest(proposals, truth, source) < 0.05
    assert all(scale.low <= p.target_from_source.scale <= scale.high for p in proposals)


def test_without_a_likely_rotation_all_are_tried():
    target, source, truth = two_prepared_maps(cave, 4, Similarity2(0.0, 0.0, 2.0))
    without_walls = [np.zeros(180)] * 2
    method = NormalCorrelation()
    descriptions = [
        WallRasters(method.describe(prepared).layers, walls)
        for prepared, walls in zip((target, source), without_walls, strict=True)
    ]
    proposals = method.propose(*descriptions, ScaleRange.known(), RNG)
    assert nearest(proposals, truth, source) < 0.06


def test_scales_are_evenly_spaced_and_hold_both_ends():
    found = np.array(scales(ScaleRange(0.5, 2.0), 1.06))
    assert (found[0], found[-1]) == (0.5, pytest.approx(2.0))
    assert np.allclose(found[1:] / found[:-1], found[1] / found[0]) and found[1] / found[0] <= 1.06
    assert scales(ScaleRange(0.7, 0.7), 1.06) == [0.7]
