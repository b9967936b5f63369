"""Weights and low-variance resampling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.particle.resampling import effective_sample_size, low_variance_sample, normalised_weights

LOGS = st.lists(st.floats(-2000.0, 2000.0), min_size=1, max_size=40)


@given(LOGS, st.floats(-1e5, 1e5))
def test_weights_sum_to_one_and_depend_on_differences_alone(logs: list[float], shift: float) -> None:
    weights = normalised_weights(np.array(logs))
    assert weights.sum() == pytest.approx(1.0)
    assert (weights >= 0.0).all()
    assert normalised_weights(np.array(logs) + shift) == pytest.approx(weights, abs=1e-9)


@given(LOGS)
def test_the_effective_size_lies_between_one_and_all(logs: list[float]) -> None:
    size = effective_sample_size(normalised_weights(np.array(logs)))
    assert 1.0 - 1e-9 <= size <= len(logs) + 1e-9


def test_known_effective_sizes() -> None:
    assert effective_sample_size(np.full(30, 1 / 30)) == pytest.approx(30.0)
    assert effective_sample_size(np.array([1.0, 0.0, 0.0])) == 1.0
    assert effective_sample_size(np.array([0.5, 0.5, 0.0, 0.0])) == pytest.approx(2.0)


@given(LOGS, st.integers(0, 1000))
def test_each_particle_is_drawn_as_often_as_its_weight_says(logs: list[float], seed: int) -> None:
    weights = normalised_weights(np.array(logs))
    drawn = np.bincount(low_variance_sample(weights, np.random.default_rng(seed)), minlength=len(logs))
    assert drawn.sum() == len(logs)
    assert (np.abs(drawn - len(logs) * weights) < 1.0 + 1e-6).all()
