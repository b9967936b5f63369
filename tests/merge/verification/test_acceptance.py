import dataclasses

import pytest

from merge.records.evidence import Evidence
from merge.records.verdict import Reason, Refusal
from merge.verification.acceptance import (
    AcceptanceSettings,
    decide,
)

GOOD = Evidence(
    acceptance_index=0.98,
    wall_inlier_ratio=0.95,
    free_space_violation=0.03,
    deep_free_space_violation=0.0,
    common_known_cells=20000.0,
    overlap=0.5,
    tolerance_cells=4.0,
    inlier_length_cells=900.0,
    normal_isotropy=0.45,
    score=0.72,
    second_best_score=0.2,
    precision_probability=1.0,
    matches=60,
    inliers=12,
    votes=6,
    local_violation=0.005,
    conflict_ratio=0.0,
    conflict_cells=0.0,
)


def test_good_evidence_is_accepted_without_a_reason():
    verdict = decide(GOOD)
    assert verdict.accepted and verdict.reason is None and verdict.confidence > 0.9


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"overlap": 0.01}, Reason.LITTLE_OVERLAP),
        ({"score": 0.15, "second_best_score": 0.05}, Reason.LITTLE_OVERLAP),
        ({"score": 0.19, "second_best_score": 0.0, "wall_inlier_ratio": 0.6}, Reason.FREE_SPACE_VIOLATION),
        (
            {"score": 0.5, "second_best_score": 0.44, "wall_inlier_ratio": 0.8, "local_violation": 0.02},
            Reason.AMBIGUOUS,
        ),
        ({"local_violation": 0.25, "conflict_ratio": 0.2}, Reason.FREE_SPACE_VIOLATION),
        (
            {"second_best_score": 0.55, "local_violation": 0.15, "conflict_ratio": 0.08, "overlap": 0.15},
            Reason.FREE_SPACE_VIOLATION,
        ),
        ({"inlier_length_cells": 20.0}, Reason.LITTLE_STRUCTURE),
        ({"normal_isotropy": 0.01}, Reason.PARALLEL_WALLS),
        ({"precision_probability": 0.4}, Reason.IMPRECISE),
        ({"second_best_score": 0.7}, Reason.AMBIGUOUS),
        ({"score": 1.0, "second_best_score": 0.95}, Reason.AMBIGUOUS),
        ({"score": 0.0, "second_best_score": 0.0, "wall_inlier_ratio": None}, Reason.FREE_SPACE_VIOLATION),
    ],
)
def test_each_fault_alone_refuses_and_is_named(change, reason):
    verdict = decide(dataclasses.replace(GOOD, **change))
    assert (verdict.accepted, verdict.reason) == (False, reason)
    assert verdict.confidence < 0.5


@pytest.mark.parametrize(
    ("name", "worse_to_better"),
    [
        ("score", (0.0, 0.3, 0.6, 0.99)),
        ("overlap", (0.0, 0.05, 0.2)),
        ("inlier_length_cells", (0.0, 50.0, 100.0)),
        ("normal_isotropy", (0.0, 0.05, 0.2)),
        ("precision_probability", (0.0, 0.5, 1.0)),
        ("second_best_score", (0.71, 0.6, 0.4, 0.0)),
    ],
)
def test_more_evidence_never_lowers_the_confidence(name, worse_to_better):
    found = [decide(dataclasses.replace(GOOD, **{name: value})).confidence for value in worse_to_better]
    assert found == sorted(found)
    assert found[0] < found[-1]
    assert all(0.0 <= confidence <= 1.0 for confidence in found)


@pytest.mark.parametrize(("name", "value"), [("min_relative_margin", -0.1), ("margin_weight", float("nan"))])
def test_a_bad_bound_is_named(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        AcceptanceSettings(**{name: value})


def test_contradiction_weighs_the_same_however_little_overlaps():
    def confidence(violation: float, conflict: float = 0.0, overlap: float = 0.3) -> float:
        found = dataclasses.replace(GOOD, local_violation=violation, conflict_ratio=conflict, overlap=overlap)
        return decide(found).confidence

    assert confidence(0.04, overlap=0.9) == confidence(0.04, overlap=0.15) < confidence(0.02) < confidence(0.0)
    assert confidence(0.2) > 0.6  # scattered objects that only one robot saw
    assert confidence(0.2) > confidence(0.2, 0.05) > 0.6 > confidence(0.2, 0.2) > confidence(0.3, 0.2)


def test_no_inlier_length_is_refused_without_a_crash():
    nothing = dataclasses.replace(GOOD, inlier_length_cells=0.0, score=0.0, second_best_score=0.0, normal_isotropy=0.0)
    assert decide(nothing).reason == Reason.LITTLE_STRUCTURE


@pytest.mark.parametrize("reason", Reason)
def test_the_text_of_a_refusal_is_read_back(reason):
    for refusal in (Refusal(reason, ", 1.6 times that"), Refusal(reason)):
        with_detail = (Reason.OTHER_SCALE, Reason.OUTSIDE_SCALES, Reason.LOW_CONFIDENCE, Reason.PUBLISHED_RULE)
        if not refusal.detail or reason in with_detail:
            assert Refusal.from_text(str(refusal)) == refusal
