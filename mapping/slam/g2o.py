"""Pose graphs as g2o text, for graph optimisers and viewers: VERTEX_SE2 and EDGE_SE2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.slam.result import Edge, SlamResult

_UPPER = np.triu_indices(3)


def g2o_text(result: SlamResult) -> str:
    """Return the keyframes as vertices, numbered from 0, with the first one fixed, and the edges with information.

    Format: g2o's wiki, "File Format", https://github.com/RainerKuemmerle/g2o/wiki/File-Format: ``VERTEX_SE2 id x y
    yaw`` and ``EDGE_SE2 first second x y yaw`` with the upper triangle of the information matrix. Numbers keep every
    bit.
    """
    lines = []
    for vertex, row in enumerate(result.trajectory.poses[result.keyframes].tolist()):
        lines.append(f"VERTEX_SE2 {vertex} {' '.join(map(str, row))}")
    lines.append("FIX 0")
    for edge in result.edges:
        motion = edge.first_from_second
        numbers = [motion.x, motion.y, motion.yaw, *information(edge)[_UPPER].tolist()]
        lines.append(f"EDGE_SE2 {edge.first} {edge.second} {' '.join(map(str, numbers))}")
    return "\n".join([*lines, ""])


def information(edge: Edge) -> NDArray[np.float64]:
    """Return the information matrix (3, 3) of an edge as g2o has it.

    g2o's error is the difference of x, y and yaw in the frame that the measurement predicts for the second pose:
    ``measurement^-1 @ first^-1 @ second``. The covariance of an edge is that of v in ``exp(v) @ first_from_second``,
    a motion seen from the first pose. The adjoint of the inverse takes it to the second:
    ``exp(v) @ T = T @ exp(Ad(T^-1) v)``.
    """
    adjoint = edge.first_from_second.inverse().adjoint()
    moved = adjoint @ edge.covariance @ adjoint.T
    inverse = np.linalg.inv(moved)
    return (inverse + inverse.T) / 2.0
