"""Choice of the tolerance, and order of the candidates."""

import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.deduplication import rms_displacement
from merge.alignment.hypotheses import Hypothesis, ranked, refine_proposals, tightest_tolerance
from merge.alignment.settings import HypothesisSettings
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


def test_crisp_maps_use_the_tightest_tolerance_and_distorted_ones_the_loosest():
    assert tightest_tolerance([CRISP]) == len(WallOverlapSettings.tolerance_shares) - 1
    assert tightest_tolerance([DISTORTED]) == 0
    assert tightest_tolerance([]) == len(WallOverlapSettings.tolerance_shares) - 1


def test_a_similar_but_wrong_placement_comes_second():
    assert ALIKE.overlap.score > CRISP.overlap.score  # by the loosest tolerance it would come first
    assert ranked([ALIKE, CRISP]) == [CRISP, ALIKE]


def test_a_tolerance_is_met_if_one_hypothesis_keeps_its_score():
    # the score is the power 2 + 1/3 of the inlier ratio
    share = 1000.0 * (HypothesisSettings.min_tolerance_score + 0.01) ** (3.0 / 7.0)
    assert tightest_tolerance([candidate(1000.0, share, 10.0, 10.0, 10.0)]) == 1
    share = 1000.0 * (HypothesisSettings.min_tolerance_score - 0.01) ** (3.0 / 7.0)
    assert tightest_tolerance([candidate(1000.0, share, 10.0, 10.0, 10.0)]) == 0


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
