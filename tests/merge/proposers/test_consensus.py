import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.proposers.consensus import ConsensusSettings, consensus

TRUTH = Similarity2(40.0, -15.0, 2.0, 1.3)


def matched(rng, truth=TRUTH, right=40, wrong=60, noise=0.5):
    source = rng.uniform(0.0, 300.0, (right + wrong, 2))
    target = truth.apply(source) + rng.normal(0.0, noise, source.shape)
    target[right:] = rng.uniform(-300.0, 300.0, (wrong, 2))
    return target, source


@pytest.mark.parametrize("seed", range(5))
def test_the_truth_comes_first_among_sixty_percent_outliers(seed):
    rng = np.random.default_rng(seed)
    target, source = matched(rng)
    best = consensus(target, source, ScaleRange.free(), rng)[0]
    off = best.target_from_source.apply(source[:40]) - TRUTH.apply(source[:40])
    assert np.hypot(*off.T).max() < 0.5
    assert best.inliers is not None and 40 <= best.inliers <= 45
    assert best.matches == 100


def test_the_scale_stays_in_its_bounds_although_a_collapse_has_more_inliers():
    rng = np.random.default_rng(0)
    source = rng.uniform(0.0, 300.0, (50, 2))
    target = np.full((50, 2), 10.0) + rng.normal(0.0, 0.1, (50, 2))  # scale 0 makes every pair an inlier
    for proposal in consensus(target, source, ScaleRange.free(), rng):
        assert 0.5 <= proposal.target_from_source.scale <= 2.0
        assert proposal.inliers < 25


def test_a_known_scale_is_kept_to_the_last_digit():
    rng = np.random.default_rng(3)
    target, source = matched(rng, Similarity2(5.0, 6.0, 1.0, 0.8))
    found = consensus(target, source, ScaleRange(0.8, 0.8), rng)
    assert found and all(proposal.target_from_source.scale == pytest.approx(0.8, abs=1e-15) for proposal in found)


def test_inliers_are_gated_in_cells_of_the_coarser_map():
    """Points off by 7 cells of the target are within 5 of the source's, which are twice as large."""
    rng = np.random.default_rng(2)
    truth, source = Similarity2(40.0, -15.0, 2.0, 2.0), rng.uniform(0.0, 600.0, (40, 2))
    around = rng.uniform(0.0, 2.0 * np.pi, 40)
    target = truth.apply(source) + 7.0 * np.stack((np.cos(around), np.sin(around)), axis=-1)
    settings = ConsensusSettings(min_inliers=30)
    best = consensus(target, source, ScaleRange(2.0, 2.0), rng, settings)[0]
    assert best.inliers is not None and best.inliers >= 30
    assert consensus(source, target, ScaleRange(0.5, 0.5), rng, settings)
    one_cell = truth.apply(source) + 2.0 * (target - truth.apply(source))
    assert consensus(one_cell, source, ScaleRange(2.0, 2.0), rng, settings) == ()


def test_two_distinct_answers_are_kept():
    rng = np.random.default_rng(4)
    other = Similarity2(-120.0, 200.0, -1.0, 0.9)
    first, second = matched(rng, TRUTH, 30, 10), matched(rng, other, 25, 10)
    target, source = (np.concatenate(parts) for parts in zip(first, second, strict=True))
    best, next_best = consensus(target, source, ScaleRange.free(), rng)[:2]
    assert best.target_from_source.yaw == pytest.approx(TRUTH.yaw, abs=0.02)
    assert next_best.target_from_source.yaw == pytest.approx(other.yaw, abs=0.02)


def test_too_few_matches_give_no_proposal():
    rng = np.random.default_rng(5)
    assert consensus(np.zeros((0, 2)), np.zeros((0, 2)), ScaleRange.free(), rng) == ()
    assert consensus(np.eye(2), np.eye(2), ScaleRange.free(), rng) == ()
    assert consensus(np.ones((9, 2)), np.ones((9, 2)), ScaleRange.free(), rng) == ()


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match="samples is 0"):
        ConsensusSettings(samples=0)
