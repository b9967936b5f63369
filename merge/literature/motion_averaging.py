"""Robust motion averaging: the poses of many maps from relative motions, some of which are wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid

Points = Sequence[NDArray[np.float64]]
"""Points (N, 2) of each map, such as the corners of its known part."""


@dataclass(frozen=True)
class RelativeMotion:
    """The answer for two maps, by their numbers: the transform from the source to the target."""

    target: int
    source: int
    target_from_source: Similarity2


@dataclass(frozen=True)
class AveragedMotions:
    """Poses of the maps in the frame of the first that is joined, None for maps that no motion joins, and a mask (E,)
    of the motions that were kept."""

    reference_from_map: tuple[Similarity2 | None, ...]
    kept: NDArray[np.bool_]


@dataclass(frozen=True)
class MotionAveraging:
    """Jiang et al. 2019, "Simultaneous merging multiple grid maps using the robust motion averaging" (Journal of
    Intelligent and Robotic Systems 94; arXiv 1706.04463).

    Published: relative motions of pairs of maps are the nodes' edges of a graph; a sampling of the graph removes
    unreliable motions; averaging those that are left gives all global motions at once.

    Chosen, since the details were not at hand: graphs are sampled as random spanning trees, of which the one that most
    motions agree with wins (Govindu 2006, "Robustness in motion averaging"); a motion agrees if it moves the points of
    its source as the tree does, up to ``most_displacement`` of their extent on average; motions are averaged in the Lie
    algebra (Govindu 2004). The algebra is that of similarities, so that maps of different resolutions can be averaged,
    as Jiang et al. treated them in 2020.

    - ``samples``: number of trees; ``iterations``: most steps of the average; ``least_step``: where they end.
    """

    samples: int = 500
    most_displacement: float = 0.05
    iterations: int = 50
    least_step: float = 1e-10

    def __post_init__(self) -> None:
        require_valid(self, shares=("most_displacement",))

    def average(self, motions: Sequence[RelativeMotion], points: Points, rng: np.random.Generator) -> AveragedMotions:
        """Place all maps that the motions join with one another; of several groups, the largest."""
        joined = _largest_group(len(points), motions)
        used = [k for k, motion in enumerate(motions) if motion.target in joined]
        best: tuple[dict[int, Similarity2], list[int]] = {}, []
        for _ in range(self.samples if used else 0):
            poses = _chained([motions[k] for k in used], joined[0], rng, len(points))
            agreeing = [k for k in used if self._agrees(motions[k], poses, points)]
            if len(agreeing) > len(best[1]):
                best = poses, agreeing
        poses, kept = best
        poses = self._averaged(poses, [motions[k] for k in kept], joined[0])
        mask = np.zeros(len(motions), np.bool_)
        mask[kept] = True
        return AveragedMotions(tuple(poses.get(k) for k in range(len(points))), mask)

    def _agrees(self, motion: RelativeMotion, poses: dict[int, Similarity2], points: Points) -> bool:
        by_poses = poses[motion.target].inverse() @ poses[motion.source]
        corners = points[motion.source]
        moved, expected = motion.target_from_source.apply(corners), by_poses.apply(corners)
        extent = float(np.hypot(*np.ptp(expected, axis=0)))
        return float(np.hypot(*(moved - expected).T).mean()) <= self.most_displacement * extent

    def _averaged(
        self, poses: dict[int, Similarity2], motions: Sequence[RelativeMotion], reference: int
    ) -> dict[int, Similarity2]:
        """Minimise the squared tangents of all loops by Gauss-Newton, the reference held: Govindu 2004, table 1."""
        free = [number for number in sorted(poses) if number != reference]
        column = {number: k for k, number in enumerate(free)}
        incidence = np.zeros((len(motions), len(free)))
        for row, motion in enumerate(motions):
            if motion.source in column:
                incidence[row, column[motion.source]] = 1.0
            if motion.target in column:
                incidence[row, column[motion.target]] = -1.0
        for _ in range(self.iterations if free else 0):
            residuals = np.array([_loop(motion, poses).log() for motion in motions])
            steps = np.linalg.lstsq(incidence, residuals, rcond=None)[0]
            poses = poses | {number: Similarity2.exp(steps[k]) @ poses[number] for number, k in column.items()}
            if np.abs(steps).max() < self.least_step:
                break
        return poses


def _loop(motion: RelativeMotion, poses: dict[int, Similarity2]) -> Similarity2:
    """Return the motion that is left on the way over a relative motion and back by the poses, in the reference."""
    return poses[motion.target] @ motion.target_from_source @ poses[motion.source].inverse()


def _largest_group(number: int, motions: Sequence[RelativeMotion]) -> list[int]:
    """Return the maps of the largest group that motions join, the first map first; of equal groups the first."""
    ends = [motion.target for motion in motions], [motion.source for motion in motions]
    graph = csr_array((np.ones(len(motions)), ends), shape=(number, number))
    labels = connected_components(graph, directed=False)[1]
    return np.flatnonzero(labels == np.bincount(labels).argmax()).tolist()


def _chained(
    motions: Sequence[RelativeMotion], root: int, rng: np.random.Generator, number: int
) -> dict[int, Similarity2]:
    """Chain the motions of a random spanning tree from the root."""
    between: dict[tuple[int, int], Similarity2] = {}
    for motion in motions:
        between[motion.target, motion.source] = motion.target_from_source
        between[motion.source, motion.target] = motion.target_from_source.inverse()
    ends = [motion.target for motion in motions], [motion.source for motion in motions]
    graph = csr_array((rng.uniform(1.0, 2.0, len(motions)), ends), shape=(number, number))
    order, before = breadth_first_order(minimum_spanning_tree(graph), root, directed=False)
    poses = {root: Similarity2.identity()}
    for node in order.tolist()[1:]:
        poses[node] = poses[int(before[node])] @ between[int(before[node]), node]
    return poses
