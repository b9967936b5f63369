"""Order of the proposers in the merge of a pair."""

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.pair.feature_cache import MapFeatures
from merge.pair.pipeline import merge_pair
from merge.records.proposal import Proposal
from merge.records.verdict import Reason
from tests.merge.literature.crisp import crisp_pair, off_share

RNG = np.random.default_rng(0)


class Fixed:
    """A proposer that returns given proposals, and counts its calls."""

    def __init__(self, *transforms):
        self.proposals = tuple(Proposal(transform) for transform in transforms)
        self.asked = False

    def describe(self, prepared):
        return None

    def propose(self, target, source, scale, rng):
        self.asked = True
        return self.proposals


def merged(*proposers):
    target, source, _ = crisp_pair()
    features = [MapFeatures(prepared, (None,) * len(proposers)) for prepared in (target, source)]
    return merge_pair(*features, ScaleRange.known(), proposers, RNG)


def test_a_sure_answer_skips_further_proposers():
    truth = crisp_pair()[2]
    first, second = Fixed(truth), Fixed(truth)
    answer = merged(first, second)
    assert answer.verdict.accepted
    assert not second.asked


def test_without_proposals_the_next_proposer_runs():
    truth = crisp_pair()[2]
    first, second = Fixed(), Fixed(truth)
    answer = merged(first, second)
    assert first.asked and second.asked
    assert answer == merged(second, first)


def test_a_wrong_proposal_does_not_hide_a_right_one():
    _, source, truth = crisp_pair()
    wrong = Similarity2(40.0, 10.0, 0.5) @ truth
    answer = merged(Fixed(wrong), Fixed(truth))
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.005


def test_without_any_proposal_the_pair_is_refused():
    answer = merged(Fixed(), Fixed())
    assert answer.target_from_source is None
    assert answer.verdict.reason == Reason.NOTHING_PROPOSED
