"""What is counted where."""

from mapquilt.benchmark.report import build_report
from mapquilt.benchmark.strata import strata
from mapquilt.benchmark.table import markdown, number_text, share_text, wrong_text
from mapquilt.evaluation.aggregation import tally, timing
from mapquilt.evaluation.statistics import Interval, Share
from merge.settings import MergeSettings
from tests.mapquilt.benchmark.made import BAD, GOOD, answer, pair, trial

TRIALS = [
    trial(pair("a", overlap=0.30, world="office", noise=1.0, mission="m0"), answer(True, GOOD)),
    trial(pair("b", overlap=0.29, world="cave", noise=0.0, mission="m0"), answer(False, GOOD)),
    trial(pair("c", overlap=0.10, world="cave", noise=1.0, mission="m1"), answer(True, BAD)),
    trial(pair("d", overlap=0.90, identifiable=False, mission="m1"), answer(True, BAD)),
    trial(pair("e", overlap=0.50, mission="m2"), answer(True, GOOD), bent=True),
    trial(pair("f", negative=True, subset="other worlds", mission="m2"), answer(True, None)),
    trial(pair("g", negative=True, subset="nothing in common", mission="m3"), answer(False, None)),
]


def names(stratum):
    return "".join(one.pair.name for one in stratum.trials)


def test_each_pair_lies_where_it_belongs():
    assert {(s.group, s.name): names(s) for s in strata(TRIALS)} == {
        ("positives", "all"): "abc",
        ("positives", "overlap 30 % and more"): "a",
        ("positives", "overlap 15 to 30 %"): "b",
        ("positives", "overlap under 15 %"): "c",
        ("not identifiable", "overlap 30 % and more"): "d",
        ("bent", "all"): "e",
        ("noise", "noise 0"): "b",
        ("noise", "noise 1"): "ac",
        ("world", "cave"): "bc",
        ("world", "office"): "a",
        ("negatives", "all"): "fg",
        ("negatives", "nothing in common"): "g",
        ("negatives", "other worlds"): "f",
        ("every pair", "all"): "abcdefg",
    }


def counts(group, name="all"):
    stratum = next(s for s in strata(TRIALS) if (s.group, s.name) == (group, name))
    found = tally(stratum, 0, seed=0)
    shares = (found.right, found.right_and_accepted, found.wrong_accepts)
    return tuple(None if share is None else share.count for share in shares)


def test_counts_by_hand():
    assert counts("positives") == (2, 1, 1)
    assert counts("not identifiable", "overlap 30 % and more") == (0, 0, 1)
    assert counts("bent") == (1, 1, 0)
    assert counts("negatives") == (None, None, 1)
    assert counts("every pair") == (None, None, 3)


def test_median_errors_are_those_of_right_answers():
    found = tally(strata(TRIALS)[0], 0, seed=0)
    assert (found.rotation_deg, found.scale_percent, found.displacement_cells) == (0.1, 0.2, 0.4)
    assert tally(strata(TRIALS)[3], 0, seed=0).rotation_deg is None


def test_missions_are_drawn_again_where_pairs_come_in_them():
    found = tally(strata(TRIALS)[0], 0, seed=0)
    assert set(found.over_missions) == {"right", "right_and_accepted", "wrong_accepts"}
    assert (found.over_missions["wrong_accepts"].low, found.over_missions["wrong_accepts"].high) == (0.0, 1.0)
    alone = [trial(pair(), answer(True, GOOD)), trial(pair(), answer(True, GOOD))]
    assert tally(strata(alone)[0], 0, seed=0).over_missions == {}


def test_times_are_told_against_plain_orb_where_it_ran():
    quick = [
        trial(pair(), answer(True, GOOD, method="orb", seconds=s), answer(True, GOOD, method="quilt", seconds=4 * s))
        for s in (0.1, 0.2, 0.4)
    ]
    (stratum, *_) = strata(quick)
    found = timing(stratum, 1, seed=0)
    assert (found.method, found.median_s) == ("quilt", 0.8)
    assert abs(found.ratio - 4.0) < 1e-12
    lonely = [trial(pair(), answer(True, GOOD, method="quilt"))]
    assert timing(strata(lonely)[0], 0, seed=0).ratio is None


def test_the_words_of_the_table():
    share = Share(38, 40, Interval(0.835, 0.986))
    assert share_text(share) == "95.0 (83.5 to 98.6)"
    assert share_text(share, Interval(0.9, 1.0)) == "95.0 (83.5 to 98.6) [90.0 to 100.0]"
    assert share_text(None) == number_text(None, 2) == "-"
    assert (number_text(0.0714, 3), number_text(0.0714, 2)) == ("0.071", "0.07")
    assert wrong_text(Share(0, 40, Interval(0.0, 0.088))) == "0 (up to 8.8)"


def test_the_markdown_has_a_line_a_stratum_and_method_in_equal_columns():
    report = build_report((MergeSettings("orb"),), 0, TRIALS)
    lines = [line for line in markdown(report).splitlines() if line.startswith("|")]
    table = [line for line in lines if line.count("|") == 12]
    assert len([line for line in table if "| orb |" in line]) == len(strata(TRIALS))
    assert "[0.0 to 100.0]" in next(line for line in table if line.startswith("| all | orb | 3 |"))
    assert any(line.startswith("| orb | 6 |") for line in lines), "calibration leaves the bent pair out"
