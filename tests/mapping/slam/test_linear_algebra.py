"""Small linear algebra against numpy, and its independence of BLAS."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.slam.linear_algebra import inverse, product, solve_upper, squared_distance, transformed


def definite(size, seed, zeros=0.0):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((size, size)) * (rng.random((size, size)) >= zeros)
    return half @ half.T + np.eye(size)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_products_and_inverses_are_those_of_numpy(seed):
    matrix, other = definite(3, seed), np.random.default_rng(seed).standard_normal((3, 3))
    assert inverse(matrix) == pytest.approx(np.linalg.inv(matrix))
    assert product(other, matrix[0]) == pytest.approx(other @ matrix[0])
    assert transformed(other, matrix) == pytest.approx(other @ matrix @ other.T)
    assert squared_distance(other[0], matrix) == pytest.approx(other[0] @ matrix @ other[0])


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 40), st.integers(0, 10_000), st.sampled_from([0.0, 0.8]))
def test_equations_are_solved_as_by_numpy(size, seed, zeros):
    matrix = definite(size, seed, zeros)
    right = np.random.default_rng(seed + 1).standard_normal(size)
    assert solve_upper(np.triu(matrix), right) == pytest.approx(np.linalg.solve(matrix, right), rel=1e-6, abs=1e-9)


def test_equations_without_a_unique_solution_are_refused():
    with pytest.raises(ValueError, match="no unique solution"):
        solve_upper(np.zeros((3, 3)), np.ones(3))


PROGRAM = """
import sys
from pathlib import Path
from mapping.slam.pipeline import slam
from tests.mapping.slam.rooms import along, log_of, ring_corridor
import numpy as np
path = along(np.array([(1.0, 1.0), (15.0, 1.0), (15.0, 9.0)]), speed=0.1)
log, _ = log_of(ring_corridor(), path, noise=0.03, odometry_noise=2.0, seed=4)
sys.stdout.write(slam(log).trajectory.poses.tobytes().hex())
"""


def test_the_bits_do_not_depend_on_the_kernels_of_blas():
    """OpenBLAS chooses its kernels by the processor; this makes it choose older ones."""
    results = {
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            check=True, capture_output=True, text=True, env=os.environ | kernels | {"PYTHONPATH": str(Path.cwd())},
        ).stdout
        for kernels in ({}, {"OPENBLAS_CORETYPE": "Sandybridge"}, {"OPENBLAS_NUM_THREADS": "1"})
    }  # fmt: skip
    assert len(results) == 1
