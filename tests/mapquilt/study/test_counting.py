"""Shares, errors and paired tests: known answers on trials that were never run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom

from mapquilt.study.counting import count_cells
from mapquilt.study.paired import ALL_LEVELS, mcnemar, paired_tests
from mapquilt.study.trial import PairTrial, TeamTrial
from tests.mapquilt.study.conftest import plan

PLAN = plan("noise=0,1")
TRIAL = PairTrial(
    mission="000",
    world="house",
    level=("0",),
    noise=0.0,
    method="quilt",
    target="robot_0",
    source="robot_1",
    overlap=0.5,
    identifiable=True,
    bent=False,
    accepted=True,
    right=True,
    confidence=0.9,
    reason=None,
    rotation_deg=0.5,
    scale_percent=0.25,
    displacement_m=0.1,
    displacement_cells=2.0,
    displacement_of_diagonal=0.01,
    acceptance_index=0.9,
    score=0.8,
    second_best_score=0.1,
    answer=(0.0, 0.0, 0.0, 1.0),
    truth=(0.0, 0.0, 0.0, 1.0),
    runner_up=None,
    runner_up_score=None,
    maps="000/00",
)


def team(mission: str, iou: float, joined: int = 2) -> TeamTrial:
    return TeamTrial(mission, "house", ("0",), "quilt", 2, joined, iou, iou / 2, 1, 0.5)


def cell(trials, teams=()):
    return count_cells(PLAN, trials, teams)[0]


def test_what_is_counted_and_what_is_not():
    trials = [
        TRIAL,
        replace(TRIAL, mission="001", accepted=False),
        replace(TRIAL, mission="002", right=False),
        replace(TRIAL, mission="003", bent=True, right=False, accepted=False),
        replace(TRIAL, mission="004", identifiable=False, right=False),
        replace(TRIAL, mission="005", overlap=0.1, right=False),
    ]
    found = cell(trials)
    assert (found.pairs, found.bent) == (4, 1)
    assert (found.right_and_accepted.count, found.right_and_accepted.of) == (1, 4)
    assert found.right.count == 2
    assert (found.wrong_accepts.count, found.wrong_accepts.of) == (3, 6)
    assert found.right_and_accepted.interval.low == pytest.approx(0.0456, abs=1e-4)
    assert found.right_and_accepted.interval.high == pytest.approx(0.6994, abs=1e-4)


def test_errors_are_those_of_accepted_answers():
    trials = [replace(TRIAL, mission=f"{k:03d}", displacement_m=k / 10.0) for k in range(11)]
    trials.append(replace(TRIAL, mission="099", accepted=False, displacement_m=50.0))
    found = cell(trials)
    assert (found.displacement_m.median, found.displacement_m.p90) == pytest.approx((0.5, 0.9))


def test_quality_is_a_mean_over_missions():
    found = cell([TRIAL], [team("000", 0.4), team("001", 0.8, joined=1)])
    assert found.iou_free.value == pytest.approx(0.6)
    assert found.joined.value == pytest.approx(0.75)
    assert found.iou_free.interval.low == pytest.approx(0.4)
    assert found.iou_free.interval.high == pytest.approx(0.8)


def test_the_overlap_that_a_level_is_about_decides_what_counts():
    about = plan("overlap=0:0.15,0.15:0.5")
    trials = [replace(TRIAL, level=("0:0.15",), overlap=overlap) for overlap in (0.0, 0.05, 0.3)]
    assert count_cells(about, trials, [])[0].pairs == 1


def sided(method_right: int, other_right: int, both: int) -> list[PairTrial]:
    """Pairs of missions of their own: so many that one method alone had right, the other alone, both."""
    trials = []
    for k in range(method_right + other_right + both):
        pair = replace(TRIAL, mission=f"{k:03d}")
        trials.append(replace(pair, accepted=not method_right <= k < method_right + other_right))
        trials.append(replace(pair, method="orb", accepted=k >= method_right))
    return trials


def test_better_is_said_where_it_can_be_shown():
    tests = {test.level: test for test in paired_tests(PLAN, sided(20, 1, 10))}
    assert (tests["0",].method_alone, tests["0",].other_alone, tests["0",].pairs) == (20, 1, 31)
    assert tests["0",].difference == pytest.approx(19 / 31)
    assert tests["0",].verdict == "better"
    assert tests["0",].interval.low < 19 / 31 < tests["0",].interval.high
    assert tests[ALL_LEVELS].pairs == 31


def test_nothing_is_said_of_three_pairs():
    assert paired_tests(PLAN, sided(3, 0, 10))[0].verdict == "no difference shown"


def test_pairs_of_one_mission_do_not_count_as_many():
    trials = [
        replace(trial, mission=f"{index // 40}", target=f"robot_{index // 2}")
        for index, trial in enumerate(sided(20, 0, 20))
    ]
    test = paired_tests(PLAN, trials)[0]
    assert test.p < 0.001
    assert test.verdict == "no difference shown"


def test_many_tests_ask_for_more():
    test = paired_tests(PLAN, sided(6, 0, 10))[0]
    assert test.p == pytest.approx(0.03125)
    assert test.p_holm == pytest.approx(0.0625)
    assert test.verdict == "no difference shown"


@given(st.integers(0, 40), st.integers(0, 40))
def test_mcnemar_is_twice_the_tail_of_a_fair_coin(a, b):
    tail = 2.0 * binom.cdf(min(a, b), a + b, 0.5) if a + b else 1.0
    assert mcnemar(a, b) == pytest.approx(min(1.0, tail))
    assert mcnemar(a, b) == mcnemar(b, a)


def test_holm_never_falls_with_the_chance():
    rng = np.random.default_rng(1)
    many = plan(f"noise={','.join(map(str, range(4)))}")
    trials = [
        replace(trial, level=(str(level),))
        for level in range(4)
        for trial in sided(int(rng.integers(12)), int(rng.integers(5)), 4)
    ]
    tests = sorted(paired_tests(many, trials), key=lambda test: test.p)
    adjusted = [test.p_holm for test in tests]
    assert adjusted == sorted(adjusted)
    assert all(test.p <= test.p_holm <= 1.0 for test in tests)
