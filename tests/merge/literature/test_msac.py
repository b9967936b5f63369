import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.similarity2 import Similarity2
from merge.literature.similarity_ransac import msac_similarity


def found(target, source, seed=0):
    rng = np.random.default_rng(seed)
    return msac_similarity(target, source, samples=300, inlier_distance=1.5, rng=rng)


@given(st.integers(0, 2**32 - 1), st.floats(0.4, 2.5), st.floats(-3.0, 3.0))
def test_the_similarity_of_most_matches_is_found_among_wrong_ones(seed, scale, yaw):
    rng = np.random.default_rng(seed)
    truth = Similarity2(*rng.uniform(-50.0, 50.0, 2), yaw, scale)
    source = rng.uniform(0.0, 300.0, (40, 2))
    target = truth.apply(source)
    target[:12] = rng.uniform(-300.0, 600.0, (12, 2))
    fit = found(target, source)
    assert fit.inliers[12:].all()
    moved = fit.target_from_source.apply(source[12:]) - target[12:]
    assert np.abs(moved).max() < 0.7  # a wrong match may come to lie within the bound, and pull


def test_of_two_sets_as_large_the_nearer_wins():
    """RANSAC counts both alike."""
    rng = np.random.default_rng(1)
    source = rng.uniform(0.0, 100.0, (20, 2))
    target = source.copy()
    target[10:] += 40.0 + rng.uniform(-0.7, 0.7, (10, 2))
    assert found(target, source).inliers.tolist() == [True] * 10 + [False] * 10


def test_nothing_is_found_without_two_different_points():
    one = np.array([[3.0, 4.0]])
    assert found(one, one) is None
    assert found(np.repeat(one, 5, axis=0), np.repeat(one, 5, axis=0)) is None
    assert found(np.empty((0, 2)), np.empty((0, 2))) is None
