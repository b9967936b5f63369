"""Result of SLAM: trajectory, keyframes, and the pose graph with the evidence of its loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.se2 import SE2
from mapping.robot.trajectory import Trajectory


@dataclass(frozen=True)
class LoopEvidence:
    """Measurements by which a loop was accepted.

    - ``overlap``: share of the query's points that lie in the target's mapped area, 0 to 1;
    - ``agreement``: smaller of the two directions' share of points that hit a wall among those that hit one or pass
      through it, 0 to 1;
    - ``runner_up``: likelihood of the best other place, or of one beside it in the least certain direction, relative to
      the accepted one.
    """

    overlap: float
    agreement: float
    runner_up: float


@dataclass(frozen=True, eq=False)
class Edge:
    """Constraint between keyframes ``first`` and ``second``, counted from 0.

    ``covariance`` (3, 3) [m, m, rad] is that of the tangent v in ``exp(v) @ first_from_second``. An edge with
    ``loop`` was found by the loop search; the others link keyframes that follow one another.
    """

    first: int
    second: int
    first_from_second: SE2
    covariance: NDArray[np.float64]
    loop: LoopEvidence | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "covariance", frozen_array(self.covariance, np.float64))


@dataclass(frozen=True, eq=False)
class SlamResult:
    """Optimised poses of a log, and the pose graph that they solve.

    - ``trajectory``: ``start_from_base`` at the stamp of each scan, the first at the identity;
    - ``keyframes``: indices of the scans that are nodes of the graph, (K,) increasing;
    - ``edges``: constraints between keyframes;
    - ``timings``: processor time of each step [s].
    """

    trajectory: Trajectory
    keyframes: NDArray[np.int64]
    edges: tuple[Edge, ...]
    timings: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        object.__setattr__(self, "keyframes", frozen_array(self.keyframes, np.int64))

    @property
    def loops(self) -> tuple[Edge, ...]:
        return tuple(edge for edge in self.edges if edge.loop is not None)


@dataclass(frozen=True, eq=False)
class JointSlamResult:
    """Optimised poses of several logs, and the one pose graph that they solve.

    - ``trajectories``: of each robot, in the frame of the first one's start;
    - ``keyframes``: indices of the scans that are nodes of the graph, (K,) increasing, counted through all logs;
    - ``edges``: constraints between keyframes;
    - ``timings``: processor time of each step [s].
    """

    trajectories: tuple[Trajectory, ...]
    keyframes: NDArray[np.int64]
    edges: tuple[Edge, ...]
    timings: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def loops_between(self, first: int, second: int) -> int:
        """Count the loops between two robots, by their numbers."""
        bounds = np.cumsum([len(each) for each in self.trajectories])
        robots = np.searchsorted(bounds, self.keyframes, side="right")
        wanted = {first, second}
        return sum(edge.loop is not None and {robots[edge.first], robots[edge.second]} == wanted for edge in self.edges)
