"""Constraints between keyframes, as the optimisers use them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.slam.linear_algebra import transformed
from mapping.slam.result import Edge, LoopEvidence


@dataclass(frozen=True, eq=False)
class Link:
    """Relative pose (3,) of keyframe ``second`` in the frame of ``first``, with its covariance (3, 3) in the additive
    x, y, yaw of that frame. ``robust`` links lose weight where the others contradict them."""

    first: int
    second: int
    relative: NDArray[np.float64]
    covariance: NDArray[np.float64]
    robust: bool = False

    def edge(self, evidence: LoopEvidence | None = None) -> Edge:
        """Return the link as an edge of the result, its covariance that of a tangent vector."""
        x, y, yaw = self.relative.tolist()
        tangent = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
        return Edge(self.first, self.second, SE2(x, y, yaw), transformed(tangent, self.covariance), evidence)


@dataclass(frozen=True, eq=False)
class LinkTable:
    """Ends (E, 2) and covariances (E, 3, 3) of links."""

    ends: NDArray[np.int64]
    covariances: NDArray[np.float64]

    @staticmethod
    def of(links: Sequence[Link]) -> LinkTable:
        ends = np.array([(link.first, link.second) for link in links], np.int64).reshape(-1, 2)
        return LinkTable(ends, np.array([link.covariance for link in links]).reshape(-1, 3, 3))

    def followed_by(self, links: Sequence[Link]) -> LinkTable:
        if not links:
            return self
        after = LinkTable.of(links)
        return LinkTable(np.vstack((self.ends, after.ends)), np.concatenate((self.covariances, after.covariances)))
