"""Sparse Cholesky factorisation in blocks of 3 x 3, whose rounding does not depend on the processor.

Source: T. Davis, "Direct Methods for Sparse Linear Systems", SIAM 2006, chapter 4: up-looking, by elimination tree.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, identity
from scipy.sparse.linalg import splu


def elimination_order(first: NDArray[np.int64], second: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Order the nodes (K,) of a graph with edges ``first`` to ``second`` (E,) so that elimination fills in little:
    those with fewest neighbours first (minimum degree).

    Of SuperLU only the order is taken, which depends on the edges alone.
    """
    ends = np.append(first, second), np.append(second, first)
    graph = csc_matrix((np.full(2 * first.size, -1.0), ends), shape=(count, count))
    dominant = graph + (2.0 * first.size + 1.0) * identity(count, format="csc")
    places = splu(dominant, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).perm_c
    return np.argsort(places).astype(np.int64)


def solve_blocks(
    rows: NDArray[np.int64], columns: NDArray[np.int64], blocks: NDArray[np.float64], right: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Solve a symmetric positive definite system, given by the blocks (B, 3, 3) of its lower triangle, for (K, 3).

    The blocks are ordered by their ``rows`` (B,); each row has one on the diagonal. Raises ``ValueError`` if the matrix
    is not definite.
    """
    starts = np.searchsorted(rows, np.arange(len(right) + 1))
    return _solve(starts, columns, blocks, _elimination_tree(starts, columns), right)


@njit(cache=True)
def _elimination_tree(starts: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the parent of each column, the row of its first entry below the diagonal once filled; -1 for a root."""
    size = starts.size - 1
    parents, ancestors = np.full(size, -1, np.int64), np.full(size, -1, np.int64)
    for k in range(size):
        for p in range(starts[k], starts[k + 1]):
            i = columns[p]
            while i != -1 and i < k:
                above = ancestors[i]
                ancestors[i] = k
                if above == -1:
                    parents[i] = k
                i = above
    return parents


@njit(cache=True)
def _row_pattern(
    row: int,
    starts: NDArray[np.int64],
    columns: NDArray[np.int64],
    parents: NDArray[np.int64],
    seen: NDArray[np.int64],
    pattern: NDArray[np.int64],
) -> int:
    """List the columns of a row of the factor at the end of ``pattern`` (K,), children before parents; return where
    they begin. ``seen`` (K,) holds the last row that met each column."""
    top = pattern.size
    seen[row] = row
    for p in range(starts[row], starts[row + 1]):
        i, length = columns[p], 0
        while seen[i] != row:
            pattern[length] = i
            seen[i] = row
            length += 1
            i = parents[i]
        while length > 0:
            length -= 1
            top -= 1
            pattern[top] = pattern[length]
    return top


@njit(cache=True)
def _solve(
    starts: NDArray[np.int64],
    columns: NDArray[np.int64],
    blocks: NDArray[np.float64],
    parents: NDArray[np.int64],
    right: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Factor the matrix row by row into columns of L, and solve L L^T x = right."""
    size = len(right)
    seen, pattern = np.full(size, -1, np.int64), np.empty(size, np.int64)
    counts = np.ones(size, np.int64)
    for k in range(size):
        for place in range(_row_pattern(k, starts, columns, parents, seen, pattern), size):
            counts[pattern[place]] += 1
    begins = np.zeros(size + 1, np.int64)
    begins[1:] = np.cumsum(counts)
    rows, factor = np.empty(begins[-1], np.int64), np.empty((begins[-1], 3, 3))
    ends, entries = begins[:-1].copy(), np.zeros((size, 3, 3))
    seen[:] = -1
    for k in range(size):
        top = _row_pattern(k, starts, columns, parents, seen, pattern)
        for p in range(starts[k], starts[k + 1]):
            entries[columns[p]] = blocks[p]
        for place in range(top, size):
            i = pattern[place]
            entry = factor[ends[i]]
            _divide(entries[i], factor[begins[i]], entry)
            entries[i] = 0.0
            for p in range(begins[i] + 1, ends[i]):
                _subtract(entries[rows[p]], factor[p], entry)
            _subtract(entries[k], entry, entry)
            rows[ends[i]] = k
            ends[i] += 1
        _factor(entries[k], factor[begins[k]])
        entries[k] = 0.0
        ends[k] += 1
    solution = right.copy()
    for j in range(size):
        for u in range(3):
            for v in range(u):
                solution[j, u] -= factor[begins[j], u, v] * solution[j, v]
            solution[j, u] /= factor[begins[j], u, u]
        for p in range(begins[j] + 1, begins[j + 1]):
            for u in range(3):
                for v in range(3):
                    solution[rows[p], u] -= factor[p, u, v] * solution[j, v]
    for j in range(size - 1, -1, -1):
        for p in range(begins[j] + 1, begins[j + 1]):
            for u in range(3):
                for v in range(3):
                    solution[j, v] -= factor[p, u, v] * solution[rows[p], u]
        for u in range(2, -1, -1):
            for v in range(u + 1, 3):
                solution[j, u] -= factor[begins[j], v, u] * solution[j, v]
            solution[j, u] /= factor[begins[j], u, u]
    return solution


@njit(cache=True)
def _factor(matrix: NDArray[np.float64], lower: NDArray[np.float64]) -> None:
    """Write the Cholesky factor of a matrix (3, 3) to ``lower``."""
    lower[:] = 0.0
    for u in range(3):
        for v in range(u + 1):
            total = matrix[u, v]
            for w in range(v):
                total -= lower[u, w] * lower[v, w]
            if u > v:
                lower[u, v] = total / lower[v, v]
            elif total > 0.0:
                lower[u, u] = math.sqrt(total)
            else:
                raise ValueError("the equations of the poses have no unique solution")


@njit(cache=True)
def _divide(matrix: NDArray[np.float64], lower: NDArray[np.float64], result: NDArray[np.float64]) -> None:
    """Write matrix @ lower^-T, all (3, 3), to ``result``."""
    for u in range(3):
        for v in range(3):
            total = matrix[u, v]
            for w in range(v):
                total -= result[u, w] * lower[v, w]
            result[u, v] = total / lower[v, v]


@njit(cache=True)
def _subtract(matrix: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """Subtract b @ a^T from ``matrix``, all (3, 3)."""
    for u in range(3):
        for v in range(3):
            matrix[u, v] -= b[u, 0] * a[v, 0] + b[u, 1] * a[v, 1] + b[u, 2] * a[v, 2]
