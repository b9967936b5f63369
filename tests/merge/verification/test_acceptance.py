import dataclasses

import pytest

from merge.records.result import Evidence
from merge.verification.acceptance import (
    BARE,
    CONTRADICTION,
    INEXACT,
    ONE_WAY,
    OVERLAP,
    RIVAL,
    AcceptanceSettings,
    decide,
)

GOOD = Evidence(
    acceptance_index=0.98,
    walls_on_walls=0.95,
    walls_in_free=0.03,
    walls_deep_in_free=0.0,
    common_known_cells=20000.0,
    overlap=0.5,
    tolerance_cells=4.0,
    matched_walls_cells=900.0,
    spread=0.45,
    agreement=0.72,
    rival_agreement=0.2,
    exactness=1.0,
    matches=60,
    inliers=12,
    votes=6,
)


def test_good_evidence_is_accepted_without_a_reason():
    decision = decide(GOOD)
    assert decision.accepted and decision.reason is None and decision.confidence > 0.9


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"overlap": 0.01}, OVERLAP),
        ({"agreement": 0.2, "rival_agreement": 0.05}, OVERLAP),
        ({"agreement": 0.29, "rival_agreement": 0.0, "walls_on_walls": 0.6}, CONTRADICTION),
        ({"agreement": 0.5, "rival_agreement": 0.42, "walls_on_walls": 0.8, "walls_deep_in_free": 0.1}, RIVAL),
        ({"matched_walls_cells": 20.0}, BARE),
        ({"spread": 0.01}, ONE_WAY),
        ({"exactness": 0.4}, INEXACT),
        ({"rival_agreement": 0.7}, RIVAL),
        ({"agreement": 1.0, "rival_agreement": 0.95}, RIVAL),
        ({"agreement": 0.0, "rival_agreement": 0.0, "walls_on_walls": None}, CONTRADICTION),
    ],
)
def test_each_fault_alone_refuses_and_is_named(change, reason):
    decision = decide(dataclasses.replace(GOOD, **change))
    assert (decision.accepted, decision.reason) == (False, reason)
    assert decision.confidence < 0.5


@pytest.mark.parametrize(
    ("name", "worse_to_better"),
    [
        ("agreement", (0.0, 0.3, 0.6, 0.99)),
        ("overlap", (0.0, 0.05, 0.2)),
        ("matched_walls_cells", (0.0, 50.0, 100.0)),
        ("spread", (0.0, 0.05, 0.2)),
        ("exactness", (0.0, 0.5, 1.0)),
        ("rival_agreement", (0.71, 0.6, 0.4, 0.0)),
    ],
)
def test_more_evidence_never_lowers_the_confidence(name, worse_to_better):
    found = [decide(dataclasses.replace(GOOD, **{name: value})).confidence for value in worse_to_better]
    assert found == sorted(found)
    assert found[0] < found[-1]
    assert all(0.0 <= confidence <= 1.0 for confidence in found)


@pytest.mark.parametrize(("name", "value"), [("min_margin", -0.1), ("lead", float("nan"))])
def test_a_bad_bound_is_named(name, value):
    with pytest.raises(ValueError, match=f"{name} is {value}"):
        AcceptanceSettings(**{name: value})


def test_what_contradicts_weighs_more_the_more_is_shared_but_no_more_than_bent_maps_bear():
    def confidence(deep: float, overlap: float = 0.3) -> float:
        return decide(dataclasses.replace(GOOD, walls_deep_in_free=deep, overlap=overlap)).confidence

    assert confidence(0.04, overlap=0.5) < confidence(0.04) < confidence(0.0)
    assert confidence(0.4) == confidence(0.8)


def test_no_walls_in_a_length_is_refused_without_a_fault():
    nothing = dataclasses.replace(GOOD, matched_walls_cells=0.0, agreement=0.0, rival_agreement=0.0, spread=0.0)
    assert decide(nothing).reason == BARE
