"""Linear algebra whose rounding does not depend on the processor, unlike that of BLAS and LAPACK.

Compiled loops without fused operations give equal bits on all processors; a different rounding can decide which of two
walls a point belongs to, and so change a map by millimetres.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert a symmetric matrix (3, 3), as covariance and information are, by its cofactors."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 1], matrix[1, 2], matrix[2, 2]
    aa, ab, ac = d * f - e * e, c * e - b * f, b * e - c * d
    determinant = a * aa + b * ab + c * ac
    result = np.empty((3, 3))
    result[0, 0], result[1, 1], result[2, 2] = aa, a * f - c * c, a * d - b * b
    result[0, 1] = result[1, 0] = ab
    result[0, 2] = result[2, 0] = ac
    result[1, 2] = result[2, 1] = b * c - a * e
    result /= determinant
    return result


@njit(cache=True)
def product(matrix: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return matrix (3, 3) times vector (3,)."""
    result = np.zeros(3)
    for i in range(3):
        for k in range(3):
            result[i] += matrix[i, k] * vector[k]
    return result


@njit(cache=True)
def transformed(matrix: NDArray[np.float64], covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return matrix @ covariance @ matrix^T, all (3, 3)."""
    left, result = np.zeros((3, 3)), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                left[i, j] += matrix[i, k] * covariance[k, j]
    for i in range(3):
        for j in range(3):
            for k in range(3):
                result[i, j] += left[i, k] * matrix[j, k]
    return result


@njit(cache=True)
def squared_distance(vector: NDArray[np.float64], information: NDArray[np.float64]) -> float:
    """Return vector^T @ information @ vector: a squared Mahalanobis distance."""
    turned = product(information, vector)
    return float(vector[0] * turned[0] + vector[1] * turned[1] + vector[2] * turned[2])


@njit(cache=True)
def solve_envelope(
    values: NDArray[np.float64], starts: NDArray[np.int64], first: NDArray[np.int64], right: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Solve a symmetric positive definite system by Cholesky's method, in place.

    Row i of the lower triangle begins in column ``first[i]``, at ``values[starts[i]]``, and ends with the diagonal;
    no entry outside that envelope is ever filled (Jennings 1966). Raises ``ValueError`` if it is not definite.
    """
    size = first.size
    for i in range(size):
        row = starts[i] - first[i]
        for j in range(first[i], i):
            low = max(first[i], first[j])
            other = starts[j] - first[j]
            total = _dot(values, row + low, other + low, j - low)
            values[row + j] = (values[row + j] - total) / values[other + j]
        square = values[row + i] - _dot(values, row + first[i], row + first[i], i - first[i])
        if not square > 0.0:
            raise ValueError("the equations of the poses have no unique solution")
        values[row + i] = math.sqrt(square)
    solution = right.copy()
    for i in range(size):
        row = starts[i] - first[i]
        total = solution[i]
        for j in range(first[i], i):
            total -= values[row + j] * solution[j]
        solution[i] = total / values[row + i]
    for i in range(size - 1, -1, -1):
        row = starts[i] - first[i]
        solution[i] /= values[row + i]
        for j in range(first[i], i):
            solution[j] -= values[row + j] * solution[i]
    return solution


@njit(cache=True)
def _dot(values: NDArray[np.float64], a: int, b: int, count: int) -> float:
    """Return the scalar product of two runs of values; eight partial sums let the processor work in parallel."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    whole = count - count % 8
    for k in range(0, whole, 8):
        s0 += values[a + k] * values[b + k]
        s1 += values[a + k + 1] * values[b + k + 1]
        s2 += values[a + k + 2] * values[b + k + 2]
        s3 += values[a + k + 3] * values[b + k + 3]
        s4 += values[a + k + 4] * values[b + k + 4]
        s5 += values[a + k + 5] * values[b + k + 5]
        s6 += values[a + k + 6] * values[b + k + 6]
        s7 += values[a + k + 7] * values[b + k + 7]
    total = ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7))
    for k in range(whole, count):
        total += values[a + k] * values[b + k]
    return total


@njit(cache=True)
def solve_upper(upper: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve a system given by the upper triangle of its matrix (N, N). Raises ``ValueError`` as ``solve_envelope``."""
    size = right.size
    first, starts = np.empty(size, np.int64), np.empty(size, np.int64)
    total = 0
    for i in range(size):
        first[i] = i
        for j in range(i):
            if upper[j, i] != 0.0:
                first[i] = j
                break
        starts[i] = total
        total += i - first[i] + 1
    values = np.empty(total)
    for i in range(size):
        for j in range(first[i], i + 1):
            values[starts[i] + j - first[i]] = upper[j, i]
    return solve_envelope(values, starts, first, right)
