"""Methods as published: their own answer instead of the common acceptance."""

from dataclasses import dataclass

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge import methods
from merge.literature.acceptance import accept_by_score, no_answer
from merge.merger import match_maps, merge_maps
from merge.methods import method_names, published_names
from merge.preparation.prepared_map import PreparedMap
from merge.settings import MergeSettings
from tests.merge.literature.crisp import crisp_pair


@pytest.fixture(scope="module")
def maps():
    prepared_maps = crisp_pair()[:2]
    grids = tuple(
        OccupancyGrid(GridFrame(0.05, c.grid.frame.origin, c.grid.frame.shape), c.grid.log_odds) for c in prepared_maps
    )
    return MapSet(("a", "b"), grids, ("m", "m"))


def test_every_published_method_is_a_proposer_too():
    assert set(published_names()) <= set(method_names())


def test_the_answer_as_published_has_no_evidence_of_the_common_acceptance(maps):
    (own,) = match_maps(maps, MergeSettings("orb", as_published=True))
    (common,) = match_maps(maps, MergeSettings("orb"))
    assert own.accepted
    assert common.accepted
    assert own.evidence is None
    assert common.evidence is not None
    gap = np.abs(own.target_from_source.matrix() - common.target_from_source.matrix()).max()
    assert 0.0 < gap < 0.3


def test_swapping_the_maps_gives_the_inverse_of_the_published_answer(maps):
    settings = MergeSettings("orb", as_published=True)
    back = MapSet(maps.names[::-1], maps.grids[::-1], maps.units)
    (one,), (other,) = match_maps(maps, settings), match_maps(back, settings)
    both = one.target_from_source @ other.target_from_source
    assert np.allclose(both.matrix(), Similarity2().matrix(), atol=1e-9)
    assert one.confidence == other.confidence


def test_matching_equals_the_first_step_of_merging(maps):
    settings = MergeSettings("orb", as_published=True)
    assert merge_maps(maps, settings).pairs[0].target_from_source == match_maps(maps, settings)[0].target_from_source


def test_a_method_without_an_answer_of_its_own_is_refused():
    with pytest.raises(ValueError, match=r"'quilt' has no answer of its own as published, only .*orb"):
        MergeSettings("quilt", as_published=True)


@pytest.mark.parametrize(("score", "accepted"), [(0.0, False), (9.9, False), (10.0, True), (1e9, True)])
def test_confidence_is_one_half_at_the_threshold_and_rises_with_the_score(score, accepted):
    verdict = accept_by_score(Similarity2(), "the score", score, 10.0).verdict
    assert verdict.accepted is accepted
    assert (verdict.confidence >= 0.5) is accepted
    assert (verdict.reason is None) is accepted
    assert verdict.confidence <= accept_by_score(Similarity2(), "the score", score + 1.0, 10.0).verdict.confidence


def test_nothing_found_is_a_refusal_with_a_reason():
    answer = no_answer()
    assert answer.target_from_source is None
    assert not answer.verdict.accepted
    assert answer.verdict.reason


def odd_maps():
    """Maps that hold next to nothing, or nothing but walls."""
    rng = np.random.default_rng(0)
    dot = np.full((70, 70), -1.0)
    dot[30, 40] = 1.0
    line = np.full((3, 90), -1.0)
    line[1] = 1.0
    return {
        "dot": dot,
        "line": line,
        "cell": np.ones((1, 1)),
        "two cells": np.array([[1.0, -1.0]]),
        "walls": np.ones((80, 80)),
        "noise": rng.choice((-1.0, 0.0, 1.0), (90, 80)),
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(published_names()))
def test_nearly_empty_maps_do_not_crash(name):
    method = MergeSettings(name).chosen_published
    grids = [
        OccupancyGrid(GridFrame(1.0, SE2(), cells.shape), cells.astype(np.float32)) for cells in odd_maps().values()
    ]
    described = [method.describe(PreparedMap(grid)) for grid in grids]
    (proposer,) = MergeSettings(name).chosen_proposers
    for target, source in zip(described, (*described[1:], described[0]), strict=True):
        answer = method.published(target, source, ScaleRange.free(), np.random.default_rng(0))
        assert 0.0 <= answer.verdict.confidence <= 1.0
        assert answer.verdict.accepted is (answer.verdict.reason is None)
        proposals = proposer.propose(target, source, ScaleRange.known(), np.random.default_rng(0))
        assert all(proposal.target_from_source.scale == pytest.approx(1.0) for proposal in proposals)


@dataclass(frozen=True)
class Collapse:
    """A method that lays one map into a small part of the other, as fits to wrong matches do."""

    scale: float

    def describe(self, prepared):
        return None

    def propose(self, target, source, scale, rng):
        return ()

    def published(self, target, source, scale, rng):
        return accept_by_score(Similarity2(scale=self.scale), "score", 2.0, 1.0)


@pytest.mark.parametrize(("scale", "found"), [(1e-16, False), (1e-4, False), (0.1, True), (10.0, True), (1e16, False)])
def test_a_transform_that_lays_a_map_into_one_cell_is_no_answer(maps, monkeypatch, scale, found):
    monkeypatch.setattr(methods, "_registered", {})
    methods.register("collapse", (Collapse(scale),), Collapse(scale))
    (answer,) = match_maps(maps, MergeSettings("collapse", as_published=True))
    assert answer.accepted is found
    assert (answer.target_from_source is not None) is found
