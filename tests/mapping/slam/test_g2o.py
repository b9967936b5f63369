"""Pose graphs as g2o text: read back, and the same Mahalanobis distances as ours."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory
from mapping.slam.g2o import g2o_text, information
from mapping.slam.result import Edge, SlamResult

seeds = st.integers(0, 2**32 - 1)


def random_edge(rng: np.random.Generator, first: int, second: int) -> Edge:
    root = rng.normal(size=(3, 3))
    motion = SE2(*rng.normal(0.0, [3.0, 3.0, 2.0]))
    return Edge(first, second, motion, root @ root.T * 1e-2 + 1e-4 * np.eye(3))


@given(seeds)
def test_an_error_weighs_the_same_in_both_frames(seed: int) -> None:
    """g2o's error vector of a true motion exp(v) @ measurement, against v under our covariance."""
    rng = np.random.default_rng(seed)
    edge = random_edge(rng, 0, 1)
    v = 1e-6 * rng.normal(size=3)
    difference = edge.first_from_second.inverse() @ SE2.exp(v) @ edge.first_from_second
    error = np.array([difference.x, difference.y, difference.yaw])
    ours = v @ np.linalg.solve(edge.covariance, v)
    np.testing.assert_allclose(error @ information(edge) @ error, ours, rtol=1e-3)


def test_vertices_and_edges_are_read_back() -> None:
    rng = np.random.default_rng(3)
    poses = Trajectory(np.arange(9.0), rng.normal(size=(9, 3)))
    result = SlamResult(poses, np.array([0, 4, 8]), (random_edge(rng, 0, 1), random_edge(rng, 0, 2)))
    vertices, edges = [], []
    for line in g2o_text(result).splitlines():
        name, *words = line.split()
        if name == "VERTEX_SE2":
            assert int(words[0]) == len(vertices)
            vertices.append([float(word) for word in words[1:]])
        elif name == "EDGE_SE2":
            edges.append((int(words[0]), int(words[1]), np.array([float(word) for word in words[2:]])))
        else:
            assert (name, words) == ("FIX", ["0"])
    np.testing.assert_array_equal(vertices, poses.poses[[0, 4, 8]])
    for edge, (first, second, numbers) in zip(result.edges, edges, strict=True):
        assert (first, second) == (edge.first, edge.second)
        motion, matrix = edge.first_from_second, information(edge)
        np.testing.assert_array_equal(numbers[:3], (motion.x, motion.y, motion.yaw))
        np.testing.assert_array_equal(numbers[3:], [matrix[i, j] for i in range(3) for j in range(i, 3)])
