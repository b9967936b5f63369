"""Words that follow from the counts."""

from dataclasses import replace

import pytest

from mapquilt.evaluation.intervals import Share
from reproductions.chen2021.answers import StudyAnswer
from reproductions.chen2021.cases import CASES
from reproductions.chen2021.make import Study, StudySpec
from reproductions.chen2021.measured import Measured
from reproductions.chen2021.tally import CaseTally, tallies
from reproductions.chen2021.verdict import remark, verdict


def tally(right, method="m", of=20, case=0, overlap=0.9, **missed):
    share = Share.counted([True] * right + [False] * (of - right))
    return CaseTally(CASES[case], method, overlap, share, share, 0, 0.1, 0.1, 1.5, 0.95, 0.97, 0.1, **missed)


def answer(right, rotation, scale, cells, transform=(0.0, 0.0, 0.0, 1.0)):
    return StudyAnswer(CASES[0].name, 0, "sift", right, True, 0.9, rotation, scale, cells, 0.95, 0.97, transform)


@pytest.mark.parametrize(
    ("plain", "corrected", "told"),
    [
        (5, 20, "the correction is ahead"),
        (18, 20, "the correction is ahead, within the intervals"),
        (20, 20, "level"),
        (20, 17, "plain SIFT is ahead, within the intervals"),
        (20, 3, "plain SIFT is ahead"),
    ],
)
def test_who_is_ahead(plain, corrected, told):
    assert verdict(tally(plain), tally(corrected)) == told


def test_a_remark_names_counts_and_what_became_of_the_rest():
    told = remark(tally(5, nearly=9, collapsed=2), tally(20))
    assert "(20 against 5 of 20). Wrong answers of SIFT: 9 at the right place but not exactly enough, 2 shrunk" in told
    assert told.endswith("inlier, 4 elsewhere. Of the right answers the error differs (median 1.5 cells against 1.5).")
    assert "Wrong answers of the correction: 17 elsewhere" in remark(tally(20), tally(3))
    assert "SIFT finds enough on maps this clean" in remark(tally(20), tally(20))
    assert "in common, and their wings look alike" in remark(tally(0, overlap=0.04), tally(1, overlap=0.04))
    assert "The noise leaves no wall" in remark(tally(0), tally(0))
    assert "One wrong pair" in remark(tally(0, case=-1), tally(0, case=-1))
    assert "One wrong pair" in remark(tally(5, case=-1), tally(17, case=-1))


def test_wrong_answers_are_told_apart():
    answers = (
        answer(True, 1.0, 1.0, 2.0),
        answer(False, 1.0, 9.0, 14.0),
        answer(False, 1.0, 93.0, 170.0, (0.0, 0.0, 0.0, 0.07)),
        answer(False, 170.0, 0.1, 200.0),
        StudyAnswer(CASES[0].name, 0, "sift", False, False, 0.0),
    )
    everywhere = tuple(replace(each, case=case.name) for case in CASES for each in answers)
    found = tallies(Study(StudySpec(5, ("sift",)), everywhere, (0.1,) * len(everywhere)), {})[0]
    assert (found.right.count, found.nearly, found.collapsed) == (1, 1, 1)


def test_the_thesis_tells_its_counts():
    assert Measured(0, 0.9, 4, 0.98).told_corrected == "4 of 5"
    assert Measured(20, 0.9, None, 0.98).told_corrected == "not run"
