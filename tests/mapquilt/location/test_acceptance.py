"""A plan's walls against a map: furniture counts for nothing, a missing wall for much; and the decision on it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from mapquilt.location.acceptance import decide_on_plan
from mapquilt.location.wall_agreement import WallAgreement, refine_on_walls, wall_agreement
from merge.records.evidence import Evidence
from merge.records.result import PairResult
from merge.records.verdict import Reason, Refusal


def rooms(inner: bool = True, furniture: bool = False) -> OccupancyGrid:
    """A hall of 8 x 6 m, with a wall across unless it is missing, and furniture if asked."""
    cells = np.full((140, 180), UNKNOWN, np.int8)
    cells[10:130, 10:170] = OCCUPIED
    cells[13:127, 13:167] = FREE
    if inner:
        cells[13:90, 88:91] = OCCUPIED
    if furniture:
        cells[30:50, 30:60] = OCCUPIED
        cells[80:100, 120:135] = OCCUPIED
    return OccupancyGrid.from_occupancy(GridFrame(0.05, SE2.identity(), cells.shape), cells)


def test_a_plan_confirms_itself_wholly() -> None:
    found = wall_agreement(rooms(), rooms(), Similarity2())
    assert found.denied == 0
    assert found.confirmed > 600


def test_furniture_in_the_map_denies_nothing_and_a_missing_wall_does() -> None:
    furnished = wall_agreement(rooms(), rooms(furniture=True), Similarity2())
    assert furnished.denied == 0
    without = wall_agreement(rooms(), rooms(inner=False), Similarity2())
    assert without.denied == pytest.approx(2 * 77, abs=12)
    assert wall_agreement(rooms(inner=False), rooms(), Similarity2()).share == 1.0


@given(x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), yaw=st.floats(-3.0, 3.0), scale=st.floats(0.5, 2.0))
def test_the_frame_of_the_plan_changes_nothing(x: float, y: float, yaw: float, scale: float) -> None:
    """The plan in other units and at another origin is the same plan."""
    grid = rooms()
    moved = Similarity2(x, y, yaw, scale)
    frame = GridFrame(0.05 * scale, SE2(x, y, yaw), grid.frame.shape)
    other = OccupancyGrid(frame, grid.log_odds)
    here, there = (
        wall_agreement(each, grid, place) for each, place in ((grid, Similarity2()), (other, moved.inverse()))
    )
    assert abs(here.confirmed - there.confirmed) <= 4
    assert there.denied <= 4


@pytest.mark.parametrize("start", [Similarity2(0.1, -0.08, 0.01, 1.01), Similarity2(-0.05, 0.1, -0.015, 0.985)])
def test_refinement_finds_the_walls_again_whatever_the_furniture(start: Similarity2) -> None:
    plan, scan = rooms(), rooms(furniture=True)
    corners = np.array([(0.7, 0.7), (8.3, 0.7), (8.3, 6.3), (0.7, 6.3)])
    turned = Similarity2(4.5, 3.5) @ start @ Similarity2(-4.5, -3.5)
    assert np.abs(turned.apply(corners) - corners).max() > 0.09
    found = refine_on_walls(plan, scan, turned)
    np.testing.assert_allclose(found.apply(corners), corners, atol=0.02)


def test_refinement_never_lessens_the_share_and_leaves_a_map_without_walls_alone() -> None:
    start = Similarity2(0.02, 0.01, 0.0, 1.0)
    found = refine_on_walls(rooms(), rooms(inner=False), start)
    assert (
        wall_agreement(rooms(), rooms(inner=False), found).share
        >= wall_agreement(rooms(), rooms(inner=False), start).share
    )
    empty = OccupancyGrid(rooms().frame, np.full(rooms().frame.shape, -1.0, np.float32))
    assert refine_on_walls(rooms(), empty, start) == start


def test_what_the_map_does_not_know_counts_neither_way() -> None:
    scan = rooms()
    half = scan.log_odds.copy()
    half[:, 95:] = 0.0
    found = wall_agreement(rooms(), OccupancyGrid(scan.frame, half), Similarity2())
    assert found.denied == 0
    assert 0 < found.confirmed < wall_agreement(rooms(), scan, Similarity2()).confirmed


EVIDENCE = Evidence(
    acceptance_index=0.9,
    wall_inlier_ratio=0.8,
    free_space_violation=0.1,
    deep_free_space_violation=0.1,
    common_known_cells=5000.0,
    overlap=0.9,
    tolerance_cells=3.0,
    inlier_length_cells=900.0,
    normal_isotropy=0.4,
    score=0.7,
    second_best_score=0.4,
    precision_probability=1.0,
    matches=None,
    inliers=None,
    votes=5,
)


def answer(confidence: float, reason: Reason | None, **changes: float) -> PairResult:
    refusal = None if reason is None else Refusal(reason)
    evidence = dataclasses.replace(EVIDENCE, **changes)  # type: ignore[arg-type]
    place = Similarity2()
    return PairResult("plan", "scan", reason is None, confidence, refusal, place, None, "m", evidence)


def test_walls_overrule_a_refusal_for_furniture() -> None:
    refused = answer(0.2, Reason.FREE_SPACE_VIOLATION)
    assert decide_on_plan(refused, WallAgreement(990, 10), ()).reason is None
    assert decide_on_plan(refused, WallAgreement(900, 100), ()).confidence < 0.75
    doubtful = decide_on_plan(refused, WallAgreement(800, 200), ())
    assert doubtful.reason == "walls contradict free space"


def test_walls_do_not_overrule_other_refusals() -> None:
    for reason in (Reason.LITTLE_OVERLAP, Reason.LITTLE_STRUCTURE, Reason.MIRRORED, Reason.IMPRECISE):
        refused = decide_on_plan(answer(0.1, reason), WallAgreement(1000, 0), ())
        assert (refused.confidence, refused.reason) == (0.1, answer(0.1, reason).reason_text)
    weak = answer(0.1, Reason.FREE_SPACE_VIOLATION, score=0.3)
    assert decide_on_plan(weak, WallAgreement(1000, 0), ()).reason is not None


def test_a_denied_plan_is_refused_although_the_merger_accepts() -> None:
    refused = decide_on_plan(answer(0.95, None), WallAgreement(700, 300), ())
    assert refused.reason == "the map shows free space where the plan has walls"
    assert refused.confidence < 0.6


def test_an_equal_place_elsewhere_leaves_the_refusal_as_ambiguous() -> None:
    close = answer(0.1, Reason.AMBIGUOUS, second_best_score=0.69)
    walls = WallAgreement(1000, 0)
    assert decide_on_plan(close, walls, (WallAgreement(900, 100),)).reason is None
    assert decide_on_plan(close, walls, (WallAgreement(100, 0),)).reason is None
    ambiguous = decide_on_plan(close, walls, (WallAgreement(995, 5),))
    assert (ambiguous.confidence, ambiguous.reason) == (0.1, "two answers equally good")


@given(
    confirmed=st.integers(0, 1000),
    more=st.integers(1, 200),
    denied=st.integers(0, 300),
    confidence=st.floats(0.0, 0.99),
    rival=st.floats(0.0, 0.7),
)
def test_confidence_rises_with_confirmed_walls_and_falls_with_denied_ones(
    confirmed: int, more: int, denied: int, confidence: float, rival: float
) -> None:
    def decided(agreement: WallAgreement) -> float:
        reason = Reason.FREE_SPACE_VIOLATION if confidence < 0.6 else None
        return decide_on_plan(answer(confidence, reason, second_best_score=rival), agreement, ()).confidence

    base = decided(WallAgreement(confirmed, denied))
    assert decided(WallAgreement(confirmed + more, denied)) >= base
    assert decided(WallAgreement(confirmed, denied + more)) <= base
    assert 0.0 <= base <= 1.0
