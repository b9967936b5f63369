"""Aggregates and paired tests of a study: known answers on pairs that were never merged."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapquilt.cli.tables import print_table
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.transform_error import TransformError
from mapquilt.study.paired import ALL_LEVELS, paired_tests
from mapquilt.study.records import TeamTrial
from mapquilt.study.results import StudyResults, asked_pairs, build_cells
from mapquilt.study.table import verdict_table
from tests.mapquilt.evaluation.examples import evaluated
from tests.mapquilt.study.conftest import plan

PLAN = plan("noise=0,1")
ERROR = TransformError(0.5, 0.25, 0.1, 2.0, 0.01)


def trial(
    mission: str = "000", level: str = "0", target: str = "robot_0", error: TransformError = ERROR, **fields: Any
):
    """Build an evaluated pair of the plan: right and accepted by default."""
    accepted, right = fields.pop("accepted", True), fields.pop("right", True)
    info = {"mission": mission, "level": (level,), "name": f"{mission}: {target}"}
    found = evaluated(accepted, error, **{"method": "quilt", "overlap": 0.5} | info | fields)
    return replace(found, right=right, pair=replace(found.pair, target=target))


def team(mission: str, iou: float, joined: int = 2) -> TeamTrial:
    return TeamTrial(mission, "house", ("0",), "quilt", 2, joined, iou, iou / 2, 1, 0.5)


def cell(trials, teams=()):
    return build_cells(PLAN, trials, teams)[0]


def test_pairs_with_one_right_answer_and_enough_overlap_count():
    trials = [
        trial(),
        trial("001", accepted=False),
        trial("002", right=False),
        trial("003", distorted=True, right=False, accepted=False),
        trial("004", identifiable=False, right=False),
        trial("005", overlap=0.1, right=False),
    ]
    found = cell(trials).pairs
    assert (found.pairs, found.asked, found.distorted) == (6, 4, 1)
    assert (found.true_accepts.count, found.true_accepts.of) == (1, 4)
    assert found.right.count == 2
    assert (found.false_accepts.count, found.false_accepts.of) == (3, 6)
    assert found.true_accepts.interval.low == pytest.approx(0.0456, abs=1e-4)
    assert found.true_accepts.interval.high == pytest.approx(0.6994, abs=1e-4)


def test_errors_are_those_of_accepted_answers():
    trials = [trial(f"{k:03d}", error=replace(ERROR, displacement_m=k / 10.0)) for k in range(11)]
    trials.append(trial("099", accepted=False, error=replace(ERROR, displacement_m=50.0)))
    found = cell(trials).pairs.errors_accepted["displacement_m"]
    assert (found.median, found.p90) == pytest.approx((0.5, 0.9))


def test_quality_is_a_mean_over_missions():
    found = cell([trial()], [team("000", 0.4), team("001", 0.8, joined=1)])
    assert found.iou_free.value == pytest.approx(0.6)
    assert found.joined.value == pytest.approx(0.75)
    assert found.iou_free.interval.low == pytest.approx(0.4)
    assert found.iou_free.interval.high == pytest.approx(0.8)


def test_a_varied_overlap_selects_the_pairs_that_count():
    about = plan("overlap=0:0.15,0.15:0.5")
    trials = [trial(level="0:0.15", overlap=overlap, negative=overlap == 0.0) for overlap in (0.0, 0.05, 0.3)]
    assert build_cells(about, trials, [])[0].pairs.asked == 1


def sided(method_right: int, other_right: int, both: int) -> list[EvaluatedPair]:
    """Pairs of missions of their own: so many that one method alone had right, the other alone, both."""
    trials = []
    for k in range(method_right + other_right + both):
        trials.append(trial(f"{k:03d}", accepted=not method_right <= k < method_right + other_right))
        trials.append(trial(f"{k:03d}", method="orb", accepted=k >= method_right))
    return trials


def test_a_method_is_better_if_it_alone_is_right_on_most():
    tests = {test.level: test for test in paired_tests(PLAN, sided(20, 1, 10))}
    assert (tests["0",].method_alone, tests["0",].other_alone, tests["0",].pairs) == (20, 1, 31)
    assert tests["0",].difference == pytest.approx(19 / 31)
    assert tests["0",].verdict == "better"
    assert tests["0",].interval.low < 19 / 31 < tests["0",].interval.high
    assert tests[ALL_LEVELS].pairs == 31


def test_three_pairs_show_no_difference():
    assert paired_tests(PLAN, sided(3, 0, 10))[0].verdict == "no difference shown"


def test_pairs_of_one_mission_are_not_independent():
    trials = [
        replace(one, pair=replace(one.pair, mission=f"{index // 40}", target=f"robot_{index // 2}"))
        for index, one in enumerate(sided(20, 0, 20))
    ]
    test = paired_tests(PLAN, trials)[0]
    assert (test.pairs, test.method_alone, test.other_alone) == (40, 20, 0)
    assert test.p == 1.0, "one mission alone differs, and its sign is a coin's"


def test_levels_of_a_pair_are_not_independent():
    trials = [replace(one, pair=replace(one.pair, level=(level,))) for level in "01" for one in sided(6, 0, 10)]
    tests = {test.level: test for test in paired_tests(PLAN, trials)}
    assert tests[ALL_LEVELS].method_alone == 12
    assert tests[ALL_LEVELS].p == tests["0",].p == pytest.approx(2.0 * 0.5**6)


def test_many_tests_require_smaller_p_values():
    test = paired_tests(PLAN, sided(6, 0, 10))[0]
    assert test.p == pytest.approx(0.03125)
    assert test.p_holm == pytest.approx(0.0625)
    assert test.verdict == "no difference shown"


def test_holm_is_monotonic():
    rng = np.random.default_rng(1)
    many = plan(f"noise={','.join(map(str, range(4)))}")
    trials = [
        replace(one, pair=replace(one.pair, level=(str(level),)))
        for level in range(4)
        for one in sided(int(rng.integers(12)), int(rng.integers(5)), 4)
    ]
    tests = sorted(paired_tests(many, asked_pairs(many, trials)), key=lambda test: test.p)
    adjusted = [test.p_holm for test in tests]
    assert adjusted == sorted(adjusted)
    assert all(test.p <= test.p_holm <= 1.0 for test in tests)


def test_the_table_of_tests_fits_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    tests = [replace(test, other="morphology as published") for test in paired_tests(PLAN, sided(20, 1, 10))]
    print_table(verdict_table(StudyResults(PLAN, (), (), (), (), (), tuple(tests))))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert any("better than" in line and "(" in line for line in lines)
