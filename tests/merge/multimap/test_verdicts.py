"""Verdicts on pairs of a team: each case of evidence has one answer, and the pair's own verdict can be restored."""

import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.multimap import verdicts
from merge.pair.task import PairTask
from merge.records.prior import Expected
from merge.records.result import PairResult
from merge.records.verdict import Reason, Refusal
from merge.settings import MergeSettings

HERE, THERE = Similarity2(1.0, 2.0, 0.1), Similarity2(9.0, 2.0, 0.1)
EXPECTED = Expected(HERE, 0.5)


def answer(place=HERE, refusal=None):
    accepted = refusal is None
    return PairResult("a", "b", accepted, 0.9 if accepted else 0.2, refusal, place, None, "m", None)


AMBIGUOUS = answer(refusal=Refusal(Reason.AMBIGUOUS))
ACCEPTED = answer()


def task():
    grid = OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), (1, 1)), [[0]])
    maps = MapSet(("a", "b"), (grid, grid), ("m", "m"))
    return PairTask.of(maps, 0, 1, ScaleRange.known(), MergeSettings(), 0)


def outcome(pair):
    return pair.accepted, pair.reason, pair.decided_by


@pytest.mark.parametrize(
    ("found", "again"), [(ACCEPTED, False), (AMBIGUOUS, True), (answer(THERE), True), (answer(None), True)]
)
def test_a_pair_is_searched_near_its_prior_if_refused_or_elsewhere(found, again):
    assert verdicts.needs_prior_search(found, EXPECTED) is again


@pytest.mark.parametrize(
    ("before", "near", "expected"),
    [
        (AMBIGUOUS, ACCEPTED, (True, None, "prior")),
        (answer(THERE), ACCEPTED, (True, None, "prior")),
        (answer(THERE), AMBIGUOUS, (False, Reason.AMBIGUOUS, "prior")),
        (answer(THERE), answer(HERE, Refusal(Reason.LITTLE_OVERLAP)), (False, Reason.CONTRADICTS_PRIOR, "prior")),
        (answer(THERE), answer(None, Refusal(Reason.CONTRADICTS_PRIOR)), (False, Reason.CONTRADICTS_PRIOR, "prior")),
        (answer(THERE, Refusal(Reason.LITTLE_OVERLAP)), answer(None), (False, Reason.CONTRADICTS_PRIOR, "prior")),
        (AMBIGUOUS, AMBIGUOUS, (False, Reason.AMBIGUOUS, "pair")),
    ],
)
def test_a_prior_recovers_what_it_confirms_and_refuses_what_it_contradicts(before, near, expected):
    found = verdicts.with_prior(before, near, EXPECTED)
    assert outcome(found) == expected
    assert found.target_from_source in (HERE, None)  # never outside of what the prior allows


def test_a_contradiction_says_how_far_off_the_maps_fit():
    found = verdicts.with_prior(answer(THERE), answer(None, Refusal(Reason.LITTLE_STRUCTURE)), EXPECTED)
    text = "contradicts the given start poses: the maps fit 8.0 m and 0 degrees from there"
    assert str(found.refusal) == text
    assert Refusal.from_text(text) == found.refusal


def test_a_guided_answer_counts_only_if_accepted_and_in_agreement():
    recovered = verdicts.with_guided_answer(AMBIGUOUS, ACCEPTED, agrees=True, bridge=0.95)
    assert outcome(recovered) == (True, None, "team")
    assert recovered.pair_refusal == Refusal(Reason.AMBIGUOUS)
    assert verdicts.with_guided_answer(AMBIGUOUS, ACCEPTED, agrees=False, bridge=0.95) is None
    assert verdicts.with_guided_answer(AMBIGUOUS, AMBIGUOUS, agrees=True, bridge=0.95) is None
    assert verdicts.with_guided_answer(AMBIGUOUS, None, agrees=True, bridge=0.95) is None


@pytest.mark.parametrize(("bridge", "confidence"), [(0.65, 0.65), (0.97, 0.9)])
def test_a_guided_answer_is_never_surer_than_the_chain_that_placed_it(bridge, confidence):
    recovered = verdicts.with_guided_answer(AMBIGUOUS, ACCEPTED, agrees=True, bridge=bridge)
    assert (recovered.accepted, recovered.confidence) == (True, confidence)


@pytest.mark.parametrize(
    ("before", "overlaps", "expected"),
    [
        (None, True, (False, Reason.NOT_SELECTED, "team")),
        (None, False, (False, Reason.NO_PREDICTED_OVERLAP, "team")),
        (ACCEPTED, True, (False, Reason.CONTRADICTS_TEAM, "team")),
        (AMBIGUOUS, True, (False, Reason.AMBIGUOUS, "pair")),
    ],
)
def test_a_pair_without_an_edge_in_the_graph_is_refused(before, overlaps, expected):
    assert outcome(verdicts.outside_graph(before, task(), overlaps)) == expected


def test_agreeing_refusals_are_accepted_with_the_confidence_of_the_fused_match():
    found = verdicts.with_agreeing_refusals(AMBIGUOUS, AMBIGUOUS, agrees=True, confidence=0.8)
    assert outcome(found) == (True, None, "team")
    assert found.confidence == 0.8
    assert verdicts.with_agreeing_refusals(AMBIGUOUS, AMBIGUOUS, agrees=False, confidence=0.8) is None
    assert verdicts.with_agreeing_refusals(AMBIGUOUS, answer(None), agrees=True, confidence=0.8) is None


@pytest.mark.parametrize("before", [ACCEPTED, AMBIGUOUS])
def test_the_verdict_of_the_pair_itself_can_be_restored(before):
    recovered = verdicts.with_guided_answer(AMBIGUOUS, ACCEPTED, agrees=True, bridge=0.95)
    assert outcome(verdicts.verdict_by_itself(before)) == outcome(before)
    assert outcome(verdicts.verdict_by_itself(recovered)) == outcome(AMBIGUOUS)
    assert outcome(verdicts.verdict_by_itself(verdicts.outside_graph(before, task(), True))) == outcome(before)
    assert verdicts.verdict_by_itself(verdicts.outside_graph(None, task(), True)) is None
