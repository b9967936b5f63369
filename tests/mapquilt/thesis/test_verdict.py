"""Words that follow from the counts."""

import pytest

from mapquilt.benchmark.intervals import Share
from mapquilt.thesis.cases import CASES
from mapquilt.thesis.measured import Measured
from mapquilt.thesis.tally import CaseTally
from mapquilt.thesis.verdict import remark, verdict


def tally(right, method="m", of=20, case=0, overlap=0.9):
    share = Share.counted([True] * right + [False] * (of - right))
    return CaseTally(CASES[case], method, overlap, share, share, 0, 0.1, 0.1, 1.5, 0.95, 0.97, 0.1)


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


def test_a_remark_names_counts_and_a_reason_that_fits():
    assert "(20 against 5 of 20). Corners outlast" in remark(tally(5), tally(20))
    assert "(3 against 20 of 20). SIFT's descriptors see" in remark(tally(20), tally(3))
    assert "in common, and their wings look alike" in remark(tally(0, overlap=0.04), tally(1, overlap=0.04))
    assert "The noise leaves no wall" in remark(tally(0), tally(0))
    assert "One wrong pair" in remark(tally(0, case=-1), tally(0, case=-1))


def test_the_thesis_tells_its_counts():
    assert Measured(0, 0.9, 4, 0.98).told_corrected == "4 of 5"
    assert Measured(20, 0.9, None, 0.98).told_corrected == "not run"
