import math

import numpy as np
import pytest

from mapquilt.evaluation import statistics
from mapquilt.evaluation.statistics import Share, mean_over_clusters, ratio_of_medians, ratio_of_medians_over_clusters


@pytest.mark.parametrize(("count", "of"), [(0, 24), (37, 40), (24, 24), (3, 7)])
def test_wilsons_interval_by_its_formula(count, of):
    share = Share.counted([k < count for k in range(of)])
    z, p = 1.959963984540054, count / of
    middle, half = p + z**2 / (2 * of), z * math.sqrt(p * (1 - p) / of + z**2 / (4 * of**2))
    low, high = ((middle + sign * half) / (1 + z**2 / of) for sign in (-1, 1))
    assert (share.count, share.of, share.value) == (count, of, p)
    assert share.interval.low == pytest.approx(max(0.0, low), abs=1e-12)
    assert share.interval.high == pytest.approx(min(1.0, high), abs=1e-12)


def test_nothing_to_count_is_refused():
    with pytest.raises(ValueError, match="nothing to count"):
        Share.counted([])


def test_pairs_of_one_mission_count_as_one():
    """Twenty missions of fifty equal pairs are as uncertain as twenty pairs."""
    hits = [k < 14 for k in range(20) for _ in range(50)]
    together = mean_over_clusters(hits, [k for k in range(20) for _ in range(50)], np.random.default_rng(0))
    alone = mean_over_clusters(hits, list(range(1000)), np.random.default_rng(0))
    spread = math.sqrt(0.7 * 0.3 / 20)
    assert together.high - together.low == pytest.approx(2 * 1.96 * spread, rel=0.15)
    assert alone.high - alone.low == pytest.approx(2 * 1.96 * spread / math.sqrt(50), rel=0.15)


@pytest.mark.parametrize("most", [1, 2500, 10**9])
def test_drawing_in_blocks_changes_no_interval(monkeypatch, most):
    """The oracle draws all resamples at once."""
    monkeypatch.setattr(statistics, "MOST_DRAWN", most)
    values, below = (np.random.default_rng(seed).uniform(1, 9, 37) for seed in (3, 4))
    drawn = np.random.default_rng(0).integers(0, 37, (statistics.RESAMPLES, 37))
    interval = mean_over_clusters(values.tolist(), range(37), np.random.default_rng(0))
    assert [interval.low, interval.high] == np.quantile(values[drawn].sum(axis=1) / 37, (0.025, 0.975)).tolist()
    _, interval = ratio_of_medians(values, below, np.random.default_rng(0))
    ratios = np.median(values[drawn], axis=1) / np.median(below[drawn], axis=1)
    assert [interval.low, interval.high] == pytest.approx(np.quantile(ratios, (0.025, 0.975)).tolist())


def test_one_mission_has_no_interval():
    assert mean_over_clusters([True, False], ["m", "m"], np.random.default_rng(0)) is None


def test_the_ratio_of_medians_of_a_fixed_multiple_is_exact():
    seconds = np.random.default_rng(1).uniform(1, 9, 31)
    ratio, interval = ratio_of_medians(3.0 * seconds, seconds, np.random.default_rng(0))
    assert ratio == pytest.approx(3.0)
    assert (interval.low, interval.high) == pytest.approx((3.0, 3.0))


def test_clusters_are_resampled_as_a_whole():
    """Four of ten clusters are of another world, so the interval depends on how often they are drawn."""
    rng = np.random.default_rng(2)
    below = [rng.uniform(1, 2, 20) for _ in range(10)]
    ratio, interval = ratio_of_medians_over_clusters([0.5 * b for b in below], below, rng)
    assert (ratio, interval.low, interval.high) == pytest.approx((0.5, 0.5, 0.5))
    mixed = [(0.5 if k < 6 else 5.0) * values for k, values in enumerate(below)]
    _, wide = ratio_of_medians_over_clusters(mixed, below, rng)
    assert wide.low < 0.7
    assert wide.high > 1.5
