"""Strata, aggregates and tables of a benchmark."""

from functools import partial

import pytest

from mapping.seeds import Role, stream
from mapquilt.benchmark.results import build_results
from mapquilt.benchmark.strata import strata
from mapquilt.benchmark.table import COLUMNS, markdown, terminal_table
from mapquilt.cli.tables import print_table
from mapquilt.evaluation.aggregation import aggregate, error_quantiles, outcome_counts
from mapquilt.evaluation.formatting import false_accept_text, number_text, share_text
from mapquilt.evaluation.statistics import Interval, Share
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated

PAIRS = [
    evaluated(True, GOOD, name="a", overlap=0.30, world="office", noise=1.0, poses="slam", mission="m0"),
    evaluated(False, GOOD, name="b", overlap=0.29, world="cave", noise=0.0, mission="m0"),
    evaluated(True, BAD, name="c", overlap=0.10, world="cave", noise=1.0, mission="m1"),
    evaluated(True, BAD, name="d", overlap=0.90, identifiable=False, mission="m1"),
    evaluated(True, GOOD, name="e", overlap=0.50, poses="odometry", mission="m2", distorted=True),
    evaluated(True, None, name="f", negative=True, subset="other worlds", mission="m2", distorted=None),
    evaluated(False, None, name="g", negative=True, subset="nothing in common", mission="m3", distorted=None),
]
NEW_RNG = partial(stream, 0, Role.BENCHMARK_BOOTSTRAP)


def names(stratum):
    return "".join(one.pair.name for one in stratum.pairs)


def test_each_pair_is_in_its_strata():
    assert {(s.group, s.name): names(s) for s in strata(PAIRS)} == {
        ("positives", "all"): "abc",
        ("positives", "overlap 30 % and more"): "a",
        ("positives", "overlap 15 to 30 %"): "b",
        ("positives", "overlap under 15 %"): "c",
        ("not identifiable", "overlap 30 % and more"): "d",
        ("distorted", "all"): "e",
        ("noise", "noise 0"): "b",
        ("noise", "noise 1"): "ac",
        ("poses", "odometry"): "e",
        ("poses", "slam"): "a",
        ("world", "cave"): "bc",
        ("world", "office"): "a",
        ("negatives", "all"): "fg",
        ("negatives", "nothing in common"): "g",
        ("negatives", "other worlds"): "f",
        ("every pair", "all"): "abcdefg",
    }


def counts(group, name="all"):
    row = next(r for r in build_results(PAIRS, 0).strata if (r.group, r.stratum) == (group, name))
    shares = (row.aggregate.right, row.aggregate.true_accepts, row.aggregate.false_accepts)
    return tuple(None if share is None else share.count for share in shares)


def test_counts_computed_by_hand():
    assert counts("positives") == (2, 1, 1)
    assert counts("not identifiable", "overlap 30 % and more") == (None, None, 1)
    assert counts("distorted") == (1, 1, 0)
    assert counts("negatives") == (None, None, 1)
    assert counts("every pair") == (None, None, 3)
    assert outcome_counts(PAIRS) == {"false_accepts": 3, "false_rejects": 1, "true_accepts": 2, "true_rejects": 1}


def test_a_pair_without_a_residual_counts_as_distorted():
    unknown = evaluated(True, GOOD, distorted=None)
    assert [(s.group, len(s.pairs)) for s in strata([unknown])] == [("distorted", 1), ("every pair", 1)]
    assert aggregate([unknown], [unknown], NEW_RNG).distorted == 1


def test_median_errors_are_those_of_right_answers():
    found = build_results(PAIRS, 0).strata[0].aggregate
    assert found.errors_right["rotation_deg"].median == pytest.approx(GOOD.rotation_deg)
    assert found.errors_accepted["rotation_deg"].median == pytest.approx((GOOD.rotation_deg + BAD.rotation_deg) / 2)
    assert error_quantiles([evaluated(True, None)])["rotation_deg"] is None


def test_precision_counts_every_accepted_pair():
    every = build_results(PAIRS, 0).strata[-1].aggregate.accepted_right
    assert (every.count, every.of) == (2, 5), "ambiguous, distorted and negative ones among them"


def test_clusters_are_worlds_of_the_target_or_missions():
    there, alone = {"mission": "m0", "geometry": "g0"}, {"mission": "m3+m4"}
    names = [evaluated(True, GOOD, **fields).pair.cluster for fields in (there, there | {"mission": "m1"}, alone, {})]
    assert names == ["g0", "g0", "made/m3", None]
    assert evaluated(True, None, mission="m0+m1", geometry="g0+g1").pair.cluster == "g0"


def test_where_all_pairs_count_or_none_each_world_counts_once():
    same = [evaluated(True, GOOD, mission=f"m{k // 10}") for k in range(40)]
    found = aggregate(same, same, NEW_RNG)
    assert found.clustered["true_accepts"] == Share.counted([True] * 4).interval
    assert found.clustered["false_accepts"] == Share.counted([False] * 4).interval
    one_world = [evaluated(True, GOOD, mission=f"m{k}", geometry="hall") for k in range(40)]
    assert aggregate(one_world, one_world, NEW_RNG).clustered == {}


def two_methods(worlds):
    """Pairs of these worlds that one method answers well, and another badly; and one negative that both accept."""
    bad = [evaluated(True, BAD, method="bad", name=str(k), mission=world) for k, world in enumerate(worlds)]
    good = [evaluated(True, GOOD, method="good", name=str(k), mission=world) for k, world in enumerate(worlds)]
    none = {"negative": True, "mission": "m0", "name": "none", "distorted": None}
    return [*bad, evaluated(True, None, method="bad", **none), *good, evaluated(True, None, method="good", **none)]


def test_methods_are_compared_by_world():
    true, false = build_results(two_methods([f"m{k}" for k in range(9)]), 0).comparisons
    assert (true.outcome, true.method, true.other) == ("true accepts", "bad", "good")
    assert (true.pairs, true.worlds, true.method_alone, true.other_alone) == (9, 9, 0, 9)
    assert (true.difference, true.interval, true.detectable) == (-1.0, Interval(-1.0, -1.0), 0.0)
    assert true.p == pytest.approx(2.0 * 0.5**9)
    assert true.p_holm == pytest.approx(4.0 * 0.5**9)
    assert (false.outcome, false.pairs, false.method_alone, false.difference) == ("false accepts", 10, 9, 0.9)
    assert true.shown and false.shown
    (row,) = [line for line in markdown(build_results(two_methods("abcdefghi"), 0)).splitlines() if "fewer" in line]
    assert row.startswith("| true accepts | bad has fewer than good | 9 | 9 | 0 : 9 | -100.0 ")


def test_many_pairs_of_one_world_show_nothing():
    true, false = build_results(two_methods(["m0"] * 30), 0).comparisons
    assert (true.pairs, true.worlds, true.p, true.interval) == (30, 1, 1.0, None)
    assert not true.shown and not false.shown


def test_missions_are_resampled_if_pairs_have_one():
    over = build_results(PAIRS, 0).strata[0].aggregate.clustered
    assert set(over) == {"right", "true_accepts", "false_accepts", "accepted_right"}
    assert over["false_accepts"] == Interval(0.0, 1.0)
    alone = [evaluated(True, GOOD), evaluated(True, GOOD)]
    assert aggregate(alone, alone, NEW_RNG).clustered == {}


def test_times_are_compared_with_plain_orb_alone_if_it_ran():
    seconds = (0.1, 0.2, 0.4)
    quick = [evaluated(True, GOOD, method="orb as published", seconds=s) for s in seconds]
    verified = [evaluated(True, GOOD, method="orb", seconds=3 * s) for s in seconds]
    slow = [evaluated(True, GOOD, method="quilt", seconds=4 * s) for s in seconds]
    rows = {
        row.method: row.timing
        for row in build_results([*slow, *verified, *quick], 0).strata
        if row.group == "positives"
    }
    assert rows["orb"].ratio == pytest.approx(3.0)
    assert rows["orb as published"].ratio == pytest.approx(1.0)
    assert rows["quilt"].median_s == 0.8
    assert rows["quilt"].ratio == pytest.approx(4.0)
    assert build_results(slow, 0).strata[0].timing.ratio is None


def test_the_text_of_the_table():
    share = Share(38, 40, Interval(0.835, 0.986))
    assert share_text(share) == "95.0 (83.5 to 98.6)"
    assert share_text(share, Interval(0.9, 1.0)) == "95.0 (83.5 to 98.6) [90.0 to 100.0]"
    assert share_text(None) == number_text(None, 2) == "-"
    assert (number_text(0.0714, 3), number_text(0.0714, 2)) == ("0.071", "0.07")
    assert false_accept_text(Share(0, 40, Interval(0.0, 0.088))) == "0 (up to 8.8)"


def test_the_markdown_has_a_line_for_each_stratum_and_method():
    lines = [line for line in markdown(build_results(PAIRS, 0)).splitlines() if line.startswith("|")]
    table = [line for line in lines if line.count("|") == len(COLUMNS) + 1]
    assert len([line for line in table if "| orb | verified |" in line]) == len(strata(PAIRS))
    assert "[0.0 to 100.0]" in next(line for line in table if line.startswith("| all | orb | verified | 3 |"))
    assert any(line.startswith("| orb | 6 |") for line in lines), "calibration leaves the distorted pair out"


def test_the_terminal_table_fits_80_columns(capsys):
    longest = [evaluated(True, GOOD, method="morphology as published", name=str(k)) for k in range(9)]
    print_table(terminal_table(build_results(longest, 0)))
    assert max(map(len, capsys.readouterr().out.rstrip().splitlines())) <= 80
