"""The sparse solver against a dense one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.slam.graph.sparse_cholesky import elimination_order, solve_blocks


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 15), st.floats(0.0, 0.5))
def test_the_solution_is_that_of_a_dense_solver(seed: int, count: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    pattern = np.kron(rng.random((count, count)) < share, np.ones((3, 3)))
    dense = rng.normal(size=pattern.shape) * pattern
    matrix = dense @ dense.T + np.eye(3 * count)
    right = rng.normal(size=(count, 3))
    found = solve_blocks(*lower_blocks(matrix), right)
    np.testing.assert_allclose(found.ravel(), np.linalg.solve(matrix, right.ravel()), rtol=1e-7, atol=1e-9)


def lower_blocks(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows, columns and values of the blocks of the lower triangle that are not zero."""
    count = len(matrix) // 3
    blocks = matrix.reshape(count, 3, count, 3).transpose(0, 2, 1, 3)
    rows, columns = np.nonzero(np.tril(blocks.any(axis=(2, 3))))
    return rows, columns, blocks[rows, columns]


def test_equations_without_a_unique_solution_are_refused() -> None:
    with pytest.raises(ValueError, match="no unique solution"):
        solve_blocks(*lower_blocks(np.ones((3, 3))), np.ones((1, 3)))


@given(st.integers(0, 2**32 - 1), st.integers(2, 50))
def test_the_order_has_each_node_once(seed: int, count: int) -> None:
    first, second = np.random.default_rng(seed).integers(0, count, (2, 60))
    assert sorted(elimination_order(first, second, count).tolist()) == list(range(count))


def test_laps_fill_less_than_in_the_order_of_time() -> None:
    """Twenty laps of a ring of 40 nodes, with a loop to the lap before at every eighth node."""
    loops = np.arange(40, 800, 8)
    first, second = np.append(np.arange(799), loops), np.append(np.arange(1, 800), loops - 40)
    places = np.argsort(elimination_order(first, second, 800))
    assert fill(places[first], places[second], 800) < 0.5 * fill(first, second, 800)


def fill(first: np.ndarray, second: np.ndarray, count: int) -> int:
    """Eliminate the nodes in turn, and count the edges of the filled graph."""
    linked = np.zeros((count, count), dtype=bool)
    linked[first, second] = linked[second, first] = True
    total = 0
    for node in range(count):
        after = np.flatnonzero(linked[node, node + 1 :]) + node + 1
        linked[np.ix_(after, after)] = True
        total += after.size
    return total
