import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.similarity_ransac import ransac_similarity


def test_inliers_of_a_known_similarity_are_separated():
    rng = np.random.default_rng(5)
    truth, source = Similarity2(12.0, -7.0, 0.4, 1.7), rng.uniform(0, 100, (60, 2))
    target = truth.apply(source)
    target[40:] += rng.uniform(20, 60, (20, 2))
    found = ransac_similarity(target, source, 3.0)
    assert np.allclose(found.target_from_source.matrix(), truth.matrix(), atol=1e-4)
    assert found.inliers[:40].all()
    assert not found.inliers[40:].any()


def test_the_proposal_is_fitted_on_the_inliers_within_the_scale():
    rng = np.random.default_rng(6)
    truth, source = Similarity2(2.0, 3.0, -0.6, 1.1), rng.uniform(0, 50, (30, 2))
    target = truth.apply(source)
    target[25:] += 40.0
    found = ransac_similarity(target, source, 3.0)
    (free,), (fixed,) = found.proposals(ScaleRange.free()), found.proposals(ScaleRange.known())
    assert np.allclose(free.target_from_source.matrix(), truth.matrix(), atol=1e-6)
    assert fixed.target_from_source.scale == 1.0
    assert (free.matches, free.inliers) == (30, 25)


def test_two_matches_give_no_proposal():
    points = np.array([[0.0, 0.0], [5.0, 5.0]])
    assert ransac_similarity(points, points, 3.0) is None
