import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity

similarities = st.builds(
    Similarity2,
    st.floats(-100, 100),
    st.floats(-100, 100),
    st.floats(-3.1, 3.1),
    st.floats(0.1, 10.0),
)
WIDE = ScaleRange(0.01, 100.0)


def cloud(seed, number=12):
    return np.random.default_rng(seed).uniform(-20.0, 20.0, (number, 2))


def error(fit, target, source):
    return float(((fit.apply(source) - target) ** 2).sum())


@given(similarities, st.integers(0, 1000))
def test_exact_pairs_give_the_exact_similarity(truth, seed):
    source = cloud(seed)
    fit = fit_similarity(truth.apply(source), source, WIDE)
    np.testing.assert_allclose(fit.matrix(), truth.matrix(), rtol=0, atol=1e-9 * (1 + truth.scale) * 100)


@given(similarities, st.integers(0, 1000), st.sampled_from([WIDE, ScaleRange.known(), ScaleRange(0.5, 2.0)]))
def test_no_similarity_nearby_within_the_bounds_fits_better(truth, seed, scale):
    rng = np.random.default_rng(seed)
    source = cloud(seed)
    target = truth.apply(source) + rng.normal(0.0, 3.0, source.shape)
    fit = fit_similarity(target, source, scale)
    best = error(fit, target, source)
    assert scale.low <= fit.scale <= scale.high
    for dx, dy, turn, growth in rng.normal(0.0, 1e-3, (40, 4)):
        other = Similarity2(fit.x + dx, fit.y + dy, fit.yaw + turn, scale.clip(fit.scale * (1 + growth)))
        assert error(other, target, source) >= best * (1 - 1e-12)


def test_scale_two_by_hand():
    source, target = np.array([(0.0, 0.0), (1.0, 0.0)]), np.array([(5.0, 5.0), (5.0, 7.0)])
    fit = fit_similarity(target, source, WIDE)
    assert (fit.x, fit.y, fit.scale) == pytest.approx((5.0, 5.0, 2.0))
    assert fit.yaw == pytest.approx(np.pi / 2)


def test_points_that_coincide_fit_nothing():
    assert fit_similarity(cloud(1, 3), np.ones((3, 2)), WIDE) is None
    assert fit_similarity(np.ones((3, 2)), cloud(1, 3), WIDE) is None
    assert fit_similarity(cloud(1, 1), cloud(2, 1), WIDE) is None
