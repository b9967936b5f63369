import numpy as np
import pytest

from mapquilt.evaluation.calibration import auc, calibration, equal_mass_bins
from tests.mapquilt.benchmark.made import BAD, GOOD, answer, pair, trial


def test_by_hand():
    told = [(0.9, GOOD, False), (0.8, BAD, False), (0.3, GOOD, False), (0.2, None, True)]
    trials = [trial(pair(negative=negative), answer(True, error, said)) for said, error, negative in told]
    found = calibration(trials, 0)
    assert found.pairs == 4
    assert found.brier == pytest.approx((0.01 + 0.64 + 0.49 + 0.04) / 4)
    assert found.base_brier == pytest.approx(0.25)
    assert found.ece == pytest.approx((0.1 + 0.8 + 0.7 + 0.2) / 4)  # four answers make four bins of one
    assert found.auc == pytest.approx(3 / 4)


def test_the_normalised_error_is_the_mean_over_right_answers():
    told = [(GOOD, 3.0), (GOOD, 6.0), (GOOD, None), (BAD, 500.0)]
    trials = [trial(pair(), answer(True, error, normalised_error=squares)) for error, squares in told]
    assert calibration(trials, 0).nees == pytest.approx(4.5)
    assert calibration(trials[2:], 0).nees is None


def test_bent_pairs_tell_nothing():
    straight, bent = trial(pair(), answer(True, GOOD, 0.9)), trial(pair(), answer(True, BAD, 0.9), bent=True)
    assert calibration([straight, bent], 0).pairs == 1
    assert calibration([bent], 0) is None


def test_a_confidence_that_means_what_it_says_has_little_calibration_error():
    rng = np.random.default_rng(3)
    said = rng.random(20_000)
    bins = equal_mass_bins(said, rng.random(20_000) < said)
    assert len(bins) == 10
    assert [one.right.of for one in bins] == [2000] * 10
    assert all(one.right.interval.low - 0.02 < one.confidence < one.right.interval.high + 0.02 for one in bins)


def test_auc_is_the_share_of_pairs_in_the_right_order():
    rng = np.random.default_rng(4)
    said, right = rng.integers(0, 6, 60) / 6, rng.random(60) < 0.4
    wins = [(a > b) + 0.5 * (a == b) for a in said[right] for b in said[~right]]
    assert auc(said, right) == pytest.approx(np.mean(wins))


def test_auc_needs_both_kinds():
    assert auc(np.array([0.2, 0.9]), np.array([True, True])) is None
