import numpy as np
import pytest

from mapquilt.evaluation.calibration import auc, calibration, equal_mass_bins
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated


def test_scores_computed_by_hand():
    answers = [(0.9, GOOD, False), (0.8, BAD, False), (0.3, GOOD, False), (0.2, None, True)]
    found = calibration([evaluated(True, error, value, negative) for value, error, negative in answers])
    assert found.pairs == 4
    assert found.brier == pytest.approx((0.01 + 0.64 + 0.49 + 0.04) / 4)
    assert found.base_brier == pytest.approx(0.25)
    assert found.ece == pytest.approx((0.1 + 0.8 + 0.7 + 0.2) / 4)  # four answers make four bins of one
    assert found.auc == pytest.approx(3 / 4)


def test_the_normalised_error_is_the_mean_over_right_answers():
    answers = [(GOOD, 3.0), (GOOD, 6.0), (GOOD, None), (BAD, 500.0)]
    pairs = [evaluated(True, error, normalised_error=squares) for error, squares in answers]
    assert calibration(pairs).nees == pytest.approx(4.5)
    assert calibration(pairs[2:]).nees is None


@pytest.mark.parametrize("distorted", [True, None])
def test_pairs_without_a_reliable_truth_are_left_out(distorted):
    reliable, other = evaluated(True, GOOD, 0.9), evaluated(True, BAD, 0.9, distorted=distorted)
    assert calibration([reliable, other]).pairs == 1
    assert calibration([other]) is None


def test_bins_of_a_calibrated_confidence_lie_on_the_diagonal():
    rng = np.random.default_rng(3)
    confidence = rng.random(20_000)
    bins = equal_mass_bins(confidence, rng.random(20_000) < confidence)
    assert len(bins) == 10
    assert [one.right.of for one in bins] == [2000] * 10
    assert all(one.right.interval.low - 0.02 < one.confidence < one.right.interval.high + 0.02 for one in bins)


def test_auc_is_the_share_of_pairs_in_the_right_order():
    rng = np.random.default_rng(4)
    confidence, right = rng.integers(0, 6, 60) / 6, rng.random(60) < 0.4
    wins = [(a > b) + 0.5 * (a == b) for a in confidence[right] for b in confidence[~right]]
    assert auc(confidence, right) == pytest.approx(np.mean(wins))


def test_auc_needs_both_kinds():
    assert auc(np.array([0.2, 0.9]), np.array([True, True])) is None
