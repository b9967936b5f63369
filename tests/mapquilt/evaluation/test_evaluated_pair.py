"""``evaluate_pair``: known answers, the table of outcomes, and invariance under motions of the world."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import Identifiability
from mapping.ground_truth.truth import PairOverlap, PairTruth
from mapquilt.evaluation.evaluated_pair import GroundTruth, PairInfo, evaluate_pair
from mapquilt.evaluation.transform_error import THESIS
from merge.records.result import PairResult
from merge.records.verdict import Reason, Refusal

KNOWN = np.pad(np.full((30, 40), -1.0, np.float32), 10)
DIAGONAL = 0.1 * 50
ALLOWED_M = 0.015 * DIAGONAL
INFO = PairInfo("a and b", "a", "b")
RIGHT, WRONG = Similarity2(0.01), Similarity2(1.0)


def grid(origin: SE2 = SE2()) -> OccupancyGrid:  # noqa: B008
    return OccupancyGrid(GridFrame(0.1, origin, KNOWN.shape), KNOWN)


def result(answer: Similarity2 | None, accepted: bool = True) -> PairResult:
    refusal = None if accepted else Refusal(Reason.LITTLE_OVERLAP)
    return PairResult("a", "b", accepted, 0.9, refusal, answer, None, "m", None)


def evaluate(answer, truth=None, accepted=True, **options):
    truth = truth or GroundTruth(Similarity2(), identifiable=True)
    return evaluate_pair(grid(), grid(), truth, result(answer, accepted), pair=INFO, method="quilt", **options)


@pytest.mark.parametrize(
    ("accepted", "answer", "identifiable", "outcome"),
    [
        (True, RIGHT, True, "true accept"),
        (True, RIGHT, False, "true accept"),
        (True, WRONG, True, "false accept"),
        (True, WRONG, False, "false accept"),
        (False, RIGHT, True, "false reject"),
        (False, WRONG, True, "false reject"),
        (False, None, True, "false reject"),
        (False, RIGHT, False, "true reject"),
        (False, WRONG, False, "true reject"),
        (False, None, False, "true reject"),
    ],
)
def test_outcome_of_each_decision(accepted, answer, identifiable, outcome):
    assert evaluate(answer, GroundTruth(Similarity2(), identifiable=identifiable), accepted).outcome == outcome


@pytest.mark.parametrize(("accepted", "outcome"), [(True, "false accept"), (False, "true reject")])
def test_a_negative_pair_has_no_right_answer(accepted, outcome):
    found = evaluate(Similarity2(), GroundTruth(None, identifiable=True), accepted)
    assert (found.outcome, found.right, found.error, found.identifiable) == (outcome, False, None, False)
    assert found.reliable and found.distorted is None


@pytest.mark.parametrize(
    ("places", "negative"), [((0.5, Identifiability(0.8, 0.1)), False), ((0.0, Identifiability(0.0, 0.0)), True)]
)
def test_footprints_without_a_common_cell_make_a_negative(places, negative):
    truth = GroundTruth.of(PairTruth(Similarity2(), True, 100, 0.02, PairOverlap(*places)), 2.0)
    assert (truth.target_from_source is None, truth.identifiable, truth.target_scale) == (negative, not negative, 2.0)


@pytest.mark.parametrize(
    ("residual", "distorted"), [(0.0, False), (0.45 * ALLOWED_M, False), (0.55 * ALLOWED_M, True), (None, None)]
)
def test_distorted_means_a_residual_of_more_than_half_the_allowed_displacement(residual, distorted):
    found = evaluate(RIGHT, GroundTruth(Similarity2(), residual_m=residual))
    assert found.distorted is distorted
    assert found.reliable is (distorted is False)


def test_the_allowed_displacement_is_in_true_metres():
    assert evaluate(RIGHT, GroundTruth(Similarity2(), residual_m=0.55 * ALLOWED_M, target_scale=2.0)).distorted is False


def test_displacement_in_true_metres_cells_and_diagonals():
    error = evaluate(Similarity2(0.03, 0.04), GroundTruth(Similarity2(), target_scale=2.0)).error
    assert error.displacement_m == pytest.approx(0.05 * 2.0)
    assert error.displacement_cells == pytest.approx(0.5)
    assert error.displacement_of_diagonal == pytest.approx(0.05 / DIAGONAL)


def test_another_criterion_decides_what_is_right():
    moved = Similarity2(0.5)  # 5 cells, a tenth of the diagonal
    assert not evaluate(moved).right
    assert evaluate(moved, criterion=THESIS).right


POSES = st.builds(SE2, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-math.pi, math.pi))


@given(POSES, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-0.2, 0.2))
def test_errors_are_invariant_under_a_common_motion_of_the_maps(motion, x, y, yaw):
    """Move the target's frame: truth, answer and grid move together, and every error stays."""
    truth, answer = Similarity2(0.4, -0.3, 0.8), Similarity2(0.4 + x, -0.3 + y, 0.8 + yaw)
    moved = Similarity2.from_se2(motion)
    here = evaluate_pair(grid(), grid(), GroundTruth(truth), result(answer), pair=INFO, method="quilt").error
    there = evaluate_pair(
        grid(motion), grid(), GroundTruth(moved @ truth), result(moved @ answer), pair=INFO, method="quilt"
    ).error
    assert there.rotation_deg == pytest.approx(here.rotation_deg, abs=1e-9)
    assert there.displacement_cells == pytest.approx(here.displacement_cells, rel=0.02, abs=1e-6)
