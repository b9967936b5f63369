import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.bridge import Bridge
from merge.multimap.graph import Cluster
from merge.multimap.misfit_odds import LEAST_JOINED, MisfitOdds

MISFITS = st.lists(st.floats(0.1, 50.0), min_size=LEAST_JOINED, max_size=60)


def odds(right, wrong, length=1000.0, prior=-2.0) -> MisfitOdds:
    return MisfitOdds(np.sort(right), np.array(wrong), length, prior)


CLEAR = odds(np.linspace(0.8, 1.3, 50), np.linspace(8.0, 40.0, 300))
"""Right alignments have misfits about 1, wrong ones 8 and more."""


def bridge(misfit, length=1000.0) -> Bridge:
    one, other = Cluster.of_one(0), Cluster.of_one(1)
    return Bridge(one, other, Similarity2.identity(), (0, 1), misfit, length)


@given(MISFITS, MISFITS, st.floats(0.1, 50.0), st.floats(0.1, 50.0))
def test_a_better_fit_never_lowers_the_odds(right, wrong, one, other):
    low, high = sorted((one, other))
    found = odds(right, wrong)
    assert found.log_odds(bridge(low)) >= found.log_odds(bridge(high))


@given(MISFITS, st.floats(0.1, 50.0))
def test_few_wrong_ones_make_no_fit_sure(right, misfit):
    few = odds(right, [20.0] * 40, prior=-2.0)
    assert few.log_odds(bridge(misfit)) <= -2.0 + math.log(41)


def test_the_tail_of_wrong_misfits_is_that_of_a_pareto_distribution():
    """A share of x^4 fits at least as well as x, of misfits up to 1."""
    wrong = (np.arange(4000) + 0.5) ** 0.25 / 4000**0.25
    for misfit in (0.9, 0.5, 0.25):
        share = odds([1.0] * 50, [], prior=0.0).log_odds(bridge(misfit)) - odds([1.0] * 50, wrong, prior=0.0).log_odds(
            bridge(misfit)
        )
        assert share == pytest.approx(4.0 * math.log(misfit), rel=0.15, abs=0.1)


def test_few_joined_pairs_say_nothing():
    assert odds([1.0] * (LEAST_JOINED - 1), [20.0] * 50).probability(bridge(1.0)) == 0.0


def test_separate_samples_are_told_apart():
    assert CLEAR.probability(bridge(1.0)) > 0.95
    assert CLEAR.probability(bridge(6.0)) < 0.5
    assert CLEAR.probability(bridge(20.0)) < 0.01


def test_right_alignments_may_fit_far_worse_than_joined_pairs():
    """Of 52 right ones in four buildings one in 26 had four times the median misfit of pairs and more."""
    alone = odds([1.0] * 50, [], prior=0.0)
    assert math.exp(alone.log_odds(bridge(4.0))) == pytest.approx(1.0 / 26.0, rel=0.5)


def test_a_short_comparison_makes_nothing_likely():
    assert CLEAR.probability(bridge(1.0, 1000.0)) > 0.95
    assert CLEAR.probability(bridge(1.0, 999.0)) == 0.0
