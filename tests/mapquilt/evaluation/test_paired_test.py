"""Tests of paired outcomes: laws, a slow oracle, and known answers."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom

from mapquilt.evaluation.paired_test import POWER, SIGNIFICANT, cluster_sums, detectable_difference, holm, sign_flip_p

SUMS = st.lists(st.integers(-5, 5), min_size=1, max_size=8).map(lambda sums: np.array(sums, np.float64))


@given(st.integers(0, 60), st.integers(0, 60))
def test_with_one_pair_in_each_cluster_it_is_mcnemars_exact_test(a, b):
    tail = 2.0 * binom.cdf(min(a, b), a + b, 0.5) if a + b else 1.0
    assert sign_flip_p(np.repeat([1.0, -1.0], [a, b])) == pytest.approx(min(1.0, tail))


@given(SUMS)
def test_it_is_the_share_of_all_sign_flips_that_reach_the_total(sums):
    totals = [abs(np.dot(signs, sums)) for signs in product((-1, 1), repeat=len(sums))]
    assert sign_flip_p(sums) == pytest.approx(np.mean(np.array(totals) >= abs(sums.sum())))


@given(SUMS)
def test_neither_names_nor_clusters_without_a_difference_matter(sums):
    assert sign_flip_p(-sums) == sign_flip_p(sums) == sign_flip_p(np.append(sums, 0.0))


@given(SUMS, st.floats(0.01, 0.5))
def test_equal_methods_are_rejected_no_more_often_than_the_level_says(sums, level):
    rejected = [sign_flip_p(np.array(signs) * sums) <= level for signs in product((-1, 1), repeat=len(sums))]
    assert np.mean(rejected) <= level


def test_twenty_differences_in_one_cluster_are_one():
    assert sign_flip_p(cluster_sums([1] * 20, ["here"] * 20)) == 1.0
    assert sign_flip_p(cluster_sums([1] * 20, list(range(20)))) == pytest.approx(2.0 * 0.5**20)
    assert cluster_sums([1, -1, 1, 1], ["b", "a", "b", "a"]).tolist() == [2.0, 0.0]


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx((0.03, 0.06, 0.06))
    assert holm([0.9, 0.8]) == (1.0, 1.0)
    assert holm([]) == ()


def test_the_detectable_difference_is_found_with_the_power_that_it_states():
    rng = np.random.default_rng(3)
    clusters = np.repeat(np.arange(60), 4)

    def drawn(mean: float) -> np.ndarray:
        """Gains of this mean, whose clusters agree: each draws its own mean within 0.15 of it."""
        of_cluster = (mean + rng.uniform(-0.15, 0.15, 60))[clusters]
        uniform = rng.random(len(clusters))
        better, worse = 0.25 + of_cluster / 2.0, 0.25 - of_cluster / 2.0
        return (uniform < better).astype(int) - (uniform > 1.0 - worse).astype(int)

    detectable = np.mean([detectable_difference(drawn(0.1).tolist(), clusters.tolist(), 1) for _ in range(50)])
    found = [sign_flip_p(cluster_sums(drawn(detectable), clusters.tolist())) < SIGNIFICANT for _ in range(400)]
    assert np.mean(found) == pytest.approx(POWER, abs=0.07)


def test_more_comparisons_need_larger_differences():
    gains, clusters = [1, 0, 0, 0, 0, 1] * 5, list("aabbcc") + list(range(24))
    assert detectable_difference(gains, clusters, 100) > detectable_difference(gains, clusters, 1) > 0.0
    assert detectable_difference([0, 0, 1], list("abc"), 1) is None, "one cluster differs"
    assert detectable_difference([1, -1, 1], list("abc"), 9) is None, "not even a difference of 1 would be found"
