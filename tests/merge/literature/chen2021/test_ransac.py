import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from merge.literature.chen2021.ransac import accept_by_index, most_inliers
from merge.verification.cell_overlap import compare_cells
from tests.merge.literature.crisp import crisp_pair


def matches(truth, right=30, wrong=30, seed=0):
    rng = np.random.default_rng(seed)
    source = rng.uniform(0, 200, (right + wrong, 2))
    target = np.concatenate((truth.apply(source[:right]), rng.uniform(0, 200, (wrong, 2))))
    return target, source


def test_exact_matches_among_wrong_ones_give_their_similarity():
    truth = Similarity2(5.0, -3.0, 2.0, 0.8)
    found = most_inliers(*matches(truth), 2000, 5.0, np.random.default_rng(0))
    assert np.allclose(found.matrix(), truth.matrix())


def test_the_result_is_one_sample_without_a_refit():
    target, source = matches(Similarity2(), wrong=0)
    target = target + np.random.default_rng(1).normal(0, 1, target.shape)
    found = most_inliers(target, source, 2000, 5.0, np.random.default_rng(0))
    residual = np.hypot(*(found.apply(source) - target).T)
    assert np.sort(residual)[:2].max() < 1e-6
    assert np.sort(residual)[2] > 1e-3


def test_the_scale_may_collapse_where_matches_are_wrong():
    """A known weakness of the method as published: at a small scale every match is an inlier."""
    rng = np.random.default_rng(2)
    source, target = rng.uniform(0, 500, (40, 2)), rng.normal(100, 1.5, (40, 2))
    assert most_inliers(target, source, 2000, 5.0, rng).scale < 0.1


def test_without_two_distinct_matches_there_is_no_similarity():
    one = np.array([(1.0, 2.0)])
    assert most_inliers(one, one, 100, 5.0, np.random.default_rng(0)) is None
    same = np.repeat(one, 5, axis=0)
    assert most_inliers(same, same + 1, 100, 5.0, np.random.default_rng(0)) is None


@pytest.mark.parametrize(
    ("answer", "reason"), [(Similarity2(1e6), "no known cell in common"), (Similarity2(scale=0.02), "10 times")]
)
def test_no_common_cell_or_a_collapsed_map_is_refused(answer, reason):
    target, source, truth = crisp_pair()

    def accepted(found):
        return accept_by_index(found, compare_cells(target.grid, source.grid, found).acceptance_index, 10.0).verdict

    assert accepted(truth).accepted
    refused = accepted(answer)
    assert not refused.accepted
    assert reason in str(refused.refusal)
