"""Choice of the tolerance, and order of the candidates."""

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.deduplication import rms_displacement
from merge.alignment.hypotheses import BentHypothesis, Hypothesis, ranked, refine_proposals
from merge.alignment.settings import ElasticSettings, HypothesisSettings
from merge.records.bend import Bend
from merge.records.proposal import Proposal
from merge.verification.settings import WallOverlapSettings
from merge.verification.wall_overlap import WallOverlap
from tests.merge.rooms import cave, rooms, two_prepared_maps

OVERLAP = WallOverlap(
    5.0, inlier_length=0.0, opposed_length=0.0, violation_length=0.0, shorter_length=1e3, normal_isotropy=0.4
)


def candidate(*inlier_length):
    """A candidate of whose 1000 cells of wall so many lie on walls, by tolerance, the others in free space."""
    overlaps = tuple(
        dataclasses.replace(OVERLAP, inlier_length=on, violation_length=1000.0 - on) for on in inlier_length
    )
    return Hypothesis(Similarity2(), overlaps, Proposal(Similarity2()))


CRISP = candidate(990.0, 990.0, 985.0, 980.0, 970.0)
ALIKE = candidate(995.0, 900.0, 700.0, 400.0, 200.0)
DISTORTED = candidate(900.0, 700.0, 500.0, 300.0, 200.0)


def bent(hypothesis: Hypothesis) -> BentHypothesis:
    """A bent hypothesis whose walls overlap so after the bend."""
    still = Bend(np.zeros(2), 10.0, np.zeros((2, 2, 2)))
    overlaps = hypothesis.overlaps
    return BentHypothesis(hypothesis.target_from_source, still, overlaps, overlaps, hypothesis.proposal)


def test_crisp_maps_are_judged_by_the_tightest_tolerance_and_blurred_ones_by_the_loosest():
    assert bent(CRISP).tightest_tolerance() == len(WallOverlapSettings.tolerance_shares) - 1
    assert bent(DISTORTED).tightest_tolerance() == 0


def test_bent_hypotheses_are_compared_by_the_mean_over_all_tolerances():
    assert ALIKE.overlap.score > CRISP.overlap.score
    assert bent(ALIKE).score() < bent(CRISP).score()


def test_strain_lowers_the_score_but_not_below_zero():
    stretched = dataclasses.replace(bent(CRISP), bend=Bend(np.zeros(2), 10.0, np.array([[[0.0, 0], [1, 0]]] * 2)))
    assert stretched.bend.strain == pytest.approx(0.1)
    free, costly = ElasticSettings(), ElasticSettings(strain_cost=100.0)
    assert np.allclose(stretched.scores(free), np.array(bent(CRISP).scores()) - 0.1 * free.strain_cost)
    assert stretched.scores(costly) == [0.0] * 5


def test_a_tolerance_is_met_if_the_score_is_kept():
    # the score is the power 2 + 1/2 of the inlier ratio
    share = 1000.0 * (HypothesisSettings.min_tolerance_score + 0.01) ** 0.4
    assert bent(candidate(1000.0, share, 10.0, 10.0, 10.0)).tightest_tolerance() == 1
    share = 1000.0 * (HypothesisSettings.min_tolerance_score - 0.01) ** 0.4
    assert bent(candidate(1000.0, share, 10.0, 10.0, 10.0)).tightest_tolerance() == 0


@pytest.mark.parametrize("order", [(ALIKE, DISTORTED, CRISP), (CRISP, ALIKE, DISTORTED)])
def test_the_order_of_candidates_does_not_matter(order):
    assert ranked(order) == [CRISP, ALIKE, DISTORTED]


@pytest.mark.slow
@pytest.mark.parametrize("build", [rooms, cave])
def test_a_proposal_that_lies_near_the_truth_is_found_among_hundreds_that_do_not(build):
    target, source, truth = two_prepared_maps(build, 3, Similarity2(3.0, 1.0, -0.7, 1.4))
    rng = np.random.default_rng(4)
    middle, reach = truth.apply(source.middle), 0.5 * target.diagonal
    proposals = []
    for k in range(300):
        near = k == 250
        scale = truth.scale * (1.05 if near else rng.uniform(0.7, 1.4))
        yaw = truth.yaw + (math.radians(4.0) if near else rng.uniform(0.5, 5.5))
        place = middle + (np.array([6.0, -5.0]) if near else rng.uniform(-reach, reach, 2))
        corner = place - Similarity2(yaw=yaw, scale=scale).apply(source.middle)
        proposals.append(Proposal(Similarity2(*corner.tolist(), yaw, scale)))
    found = refine_proposals(target, source, proposals, ScaleRange.free())
    assert rms_displacement(source, [truth, found[0].target_from_source])[0, 1] < 1.0  # cells
    assert rms_displacement(source, [truth, proposals[250].target_from_source])[0, 1] > 8.0
