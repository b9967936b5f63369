import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.chen2021.corner_consensus import ConsensusSettings, corner_consensus

QUARTERS = [k * math.pi / 2 for k in range(4)]


def corner_sets(rng, truth, shared=25, others=40):
    """Corners of two maps: some are the same places, to a cell, the others chance."""
    source = rng.uniform(0, 300, (shared + others, 2))
    seen = truth.apply(source[:shared]) + truth.scale * rng.normal(0, 0.7, (shared, 2))
    chance = truth.apply(rng.uniform(0, 300, (others, 2)))
    return rng.permutation(np.concatenate((seen, chance))), source


def off(answer, truth):
    points = np.array([(0, 0), (300, 0), (0, 300), (300, 300)], float)
    return np.hypot(*(answer.apply(points) - truth.apply(points)).T).max() / truth.scale


@pytest.mark.parametrize("quarter", range(4))
def test_a_quarter_turn_is_found_among_chance_corners(quarter):
    truth = Similarity2(40.0, -25.0, QUARTERS[quarter], 1.0)
    target, source = corner_sets(np.random.default_rng(quarter), truth)
    best = corner_consensus(target, source, QUARTERS, ScaleRange.known())[0]
    assert off(best.target_from_source, truth) < 2.0
    assert best.inliers >= 23
    assert len(set(best.target.tolist())) == len(best.target) == len(best.source)
    there = best.target_from_source.apply(source[best.source])
    assert np.hypot(*(there - target[best.target]).T).max() <= 5.0


@pytest.mark.parametrize("scale", [0.55, 1.3, 1.9])
def test_the_scale_is_found_within_its_range(scale):
    truth = Similarity2(5.0, 60.0, math.pi / 2, scale)
    target, source = corner_sets(np.random.default_rng(3), truth)
    best = corner_consensus(target, source, QUARTERS, ScaleRange.free())[0]
    assert off(best.target_from_source, truth) < 3.0


def test_any_rotation_is_found_without_a_main_direction():
    truth = Similarity2(5.0, 60.0, 0.83, 1.0)
    target, source = corner_sets(np.random.default_rng(4), truth)
    best = corner_consensus(target, source, None, ScaleRange.known())[0]
    assert off(best.target_from_source, truth) < 2.0
    assert all(
        off(one.target_from_source, truth) > 5.0
        for one in corner_consensus(target, source, QUARTERS, ScaleRange.known())
    )


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "scale"), [(0, 0.62), (1, 0.87), (2, 1.04), (3, 1.9)])
def test_the_coarse_search_finds_what_trying_every_rotation_and_scale_finds(seed, scale):
    rng = np.random.default_rng(seed)
    truth = Similarity2(5.0, 60.0, rng.uniform(-math.pi, math.pi), scale)
    target, source = corner_sets(rng, truth, shared=18, others=12)
    fast = corner_consensus(target, source, None, ScaleRange.free())[0]
    every = corner_consensus(target, source, None, ScaleRange.free(), ConsensusSettings(coarse_steps=1.0))[0]
    assert off(fast.target_from_source, truth) < 3.0
    assert off(fast.target_from_source, every.target_from_source) < 1.0
    assert fast.inliers >= every.inliers - 1


def test_results_are_deterministic_and_sorted_by_inliers():
    target, source = corner_sets(np.random.default_rng(5), Similarity2(1.0, 2.0, math.pi, 1.0))
    one, other = (corner_consensus(target, source, QUARTERS, ScaleRange.known()) for _ in range(2))
    assert [a.target_from_source for a in one] == [a.target_from_source for a in other]
    assert [a.inliers for a in one] == sorted((a.inliers for a in one), reverse=True)


def test_a_known_scale_is_kept():
    target, source = corner_sets(np.random.default_rng(6), Similarity2(1.0, 2.0, 0.0, 1.05))
    for one in corner_consensus(target, source, QUARTERS, ScaleRange.known()):
        assert one.target_from_source.scale == 1.0


def test_too_few_corners_give_no_match():
    few = np.array([(0.0, 0.0), (50.0, 0.0)])
    assert corner_consensus(few, few, QUARTERS, ScaleRange.known()) == []
    assert corner_consensus(np.empty((0, 2)), few, None, ScaleRange.free()) == []


def test_coincident_corners_give_no_match():
    place = np.full((30, 2), 7.0)
    assert corner_consensus(place, place, None, ScaleRange.free()) == []


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match="inlier_distance_cells is 0"):
        ConsensusSettings(inlier_distance_cells=0)
