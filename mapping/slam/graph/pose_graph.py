"""Pose graph of the keyframes: Gauss-Newton on sparse normal equations, and the uncertainty of relative poses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mapping.slam.graph.sparse_cholesky import elimination_order, solve_blocks
from mapping.slam.linear_algebra import inverse, product, squared_distance, transformed
from mapping.slam.link import Link, LinkTable

FIXED = 1e12
"""Information that keeps the first keyframe in its place."""

LEVER = 5.0
"""Distance [m] at which an error of yaw counts as one of position, where the least uncertain path is chosen."""

SETTLED = 1e-5
"""Gauss-Newton ends when no pose moves by more [m, rad]."""


def optimise_poses(
    poses: NDArray[np.float64], links: Sequence[Link], iterations: int, robust_deviations: float
) -> NDArray[np.float64]:
    """Return the poses (K, 3) that agree best with the links; the first stays in its place.

    Robust links are weighted by Cauchy's function, ``1 / (1 + chi^2 / width^2)``. The width begins at the largest chi
    and is halved in each step until it is ``robust_deviations``: else true loops lose against a track that erred by
    many of their deviations. Sources: Grisetti, Kuemmerle, Stachniss and Burgard, "A tutorial on graph-based SLAM",
    2010; Yang, Antonante, Tzoumas and Carlone, "Graduated non-convexity for robust spatial perception", 2020.
    """
    first, second, relative, information, robust = _arrays(links)
    poses = poses.copy()
    order = elimination_order(first, second, len(poses))
    places = np.argsort(order)
    keys, entries = _lower_triangle(places[first], places[second], len(poses))
    rows, columns = np.divmod(keys, len(poses))
    forward = (places[first] > places[second])[:, None, None]
    width = math.sqrt(max(chi_squared(poses, [link for link in links if link.robust]), default=0.0))
    for _ in range(iterations):
        width = max(0.5 * width, robust_deviations)
        blocks, gradient = _linearised(poses, first, second, relative, information, robust, width)
        crossing = np.where(forward, blocks[:, 0, 1], blocks[:, 1, 0])
        matrix = np.zeros((keys.size, 3, 3))
        np.add.at(matrix, entries, np.concatenate([blocks[:, 0, 0], blocks[:, 1, 1], crossing]))
        matrix[np.searchsorted(keys, places[0] * (len(poses) + 1))] += FIXED * np.eye(3)
        step = solve_blocks(rows, columns, matrix, -gradient.reshape(-1, 3)[order])
        poses[order] += step
        if width == robust_deviations and np.abs(step).max() < SETTLED:
            break
    return poses


def chi_squared(poses: NDArray[np.float64], links: Sequence[Link]) -> NDArray[np.float64]:
    """Return the squared Mahalanobis distance of each link from the poses."""
    if not links:
        return np.zeros(0)
    first, second, relative, information, _ = _arrays(links)
    errors = _errors(poses, first, second, relative)
    return np.array([squared_distance(error, weight) for error, weight in zip(errors, information, strict=True)])


def relative_covariances(links: LinkTable, origin: int, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance (K, 3, 3) of each keyframe's pose as seen from ``origin``, in the frame of the poses.

    It is compounded along the path of least variance (Dijkstra; Thrun et al. 2005, chapter 10): an upper bound.
    """
    count, (first, second) = len(poses), links.ends.T
    steps = _turned(links.covariances, poses[first, 2])
    weights = steps[:, 0, 0] + steps[:, 1, 1] + LEVER**2 * steps[:, 2, 2]
    order = np.lexsort((weights, second, first))
    keys, places = np.unique(first[order] * count + second[order], return_index=True)
    best = order[places]  # of parallel links the most certain one
    graph = csr_matrix((weights[best], (first[best], second[best])), shape=(count, count))
    distance, parents = dijkstra(graph, directed=False, indices=np.array(origin), return_predecessors=True)
    nodes = np.argsort(distance, kind="stable")
    nodes = nodes[parents[nodes] >= 0]
    forward = np.searchsorted(keys, parents[nodes] * count + nodes)
    backward = np.searchsorted(keys, nodes * count + parents[nodes])
    is_forward = keys[np.minimum(forward, keys.size - 1)] == parents[nodes] * count + nodes
    chosen = best[np.where(is_forward, forward, backward)]
    result = np.full((count, 3, 3), np.inf)
    result[origin] = 0.0
    _compound(result, nodes, parents, steps[chosen], is_forward, poses)
    return result


@njit(cache=True)
def _turned(covariances: NDArray[np.float64], yaws: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn covariances (E, 3, 3), each by its own yaw (E,) [rad]."""
    turned = np.empty_like(covariances)
    for k in range(yaws.size):
        c, s = math.cos(yaws[k]), math.sin(yaws[k])
        turned[k] = transformed(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), covariances[k])
    return turned


@njit(cache=True)
def _compound(
    result: NDArray[np.float64],
    nodes: NDArray[np.int64],
    parents: NDArray[np.int32],
    steps: NDArray[np.float64],
    is_forward: NDArray[np.bool_],
    poses: NDArray[np.float64],
) -> None:
    """Fill in the covariances (K, 3, 3) of nodes (M,), in the order of their distance from the origin.

    ``steps`` (M, 3, 3) are the covariances of the links from their parents; those that are not forward lead back, and
    their error of yaw turns them about the node.
    """
    for k in range(nodes.size):
        node, above = nodes[k], parents[nodes[k]]
        dx, dy = poses[node, 0] - poses[above, 0], poses[node, 1] - poses[above, 1]
        move = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])
        step = steps[k] if is_forward[k] else transformed(move, steps[k])
        result[node] = transformed(move, result[above]) + step


def _arrays(links: Sequence[Link]) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray]:  # type: ignore[type-arg]
    first = np.array([link.first for link in links])
    second = np.array([link.second for link in links])
    relative = np.stack([link.relative for link in links])
    information = np.stack([inverse(link.covariance) for link in links])
    return first, second, relative, information, np.array([link.robust for link in links])


def _lower_triangle(
    first: NDArray[np.int64], second: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the keys (B,) of the blocks of the lower triangle, ``row * count + column`` in rising order, and which of
    them the blocks (3 E,) of the links add to: those of the first ends, of the second, and of both."""
    both = np.maximum(first, second) * count + np.minimum(first, second)
    of_links = np.concatenate([first * (count + 1), second * (count + 1), both])
    keys = np.union1d(of_links, np.arange(count) * (count + 1))
    return keys, np.searchsorted(keys, of_links)


@njit(cache=True)
def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    result = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                result[i, j] += a[i, k] * b[k, j]
    return result


def linearised(
    poses: NDArray[np.float64], links: Sequence[Link], robust_deviations: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the blocks of the links' normal equations (E, 2, 2, 3, 3), and the gradient (3 K,)."""
    return _linearised(poses, *_arrays(links), robust_deviations)


@njit(cache=True)
def _errors(
    poses: NDArray[np.float64], first: NDArray[np.int64], second: NDArray[np.int64], relative: NDArray[np.float64]
) -> NDArray[np.float64]:
    errors = np.empty((first.size, 3))
    for k in range(first.size):
        a, b = poses[first[k]], poses[second[k]]
        c, s = math.cos(a[2]), math.sin(a[2])
        dx, dy = b[0] - a[0], b[1] - a[1]
        errors[k, 0] = c * dx + s * dy - relative[k, 0]
        errors[k, 1] = c * dy - s * dx - relative[k, 1]
        yaw = b[2] - a[2] - relative[k, 2]
        errors[k, 2] = math.atan2(math.sin(yaw), math.cos(yaw))
    return errors


@njit(cache=True)
def _linearised(
    poses: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    relative: NDArray[np.float64],
    information: NDArray[np.float64],
    robust: NDArray[np.bool_],
    robust_deviations: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the blocks of the normal equations (E, 2, 2, 3, 3), and the gradient (3 K,)."""
    errors = _errors(poses, first, second, relative)
    blocks = np.empty((first.size, 2, 2, 3, 3))
    gradient = np.zeros(3 * poses.shape[0])
    jacobian = np.zeros((2, 3, 3))
    for k in range(first.size):
        a, b = poses[first[k]], poses[second[k]]
        c, s = math.cos(a[2]), math.sin(a[2])
        dx, dy = b[0] - a[0], b[1] - a[1]
        jacobian[1] = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        jacobian[0] = -jacobian[1]
        jacobian[0, 0, 2], jacobian[0, 1, 2] = c * dy - s * dx, -c * dx - s * dy
        weighted = information[k]
        if robust[k]:
            weighted = weighted / (1.0 + squared_distance(errors[k], weighted) / robust_deviations**2)
        for u in range(2):
            node = 3 * (first[k] if u == 0 else second[k])
            pull = _product(jacobian[u].T, weighted)
            gradient[node : node + 3] += product(pull, errors[k])
            for v in range(2):
                blocks[k, u, v] = _product(pull, jacobian[v])
    return blocks, gradient
