"""Poses of all maps of a graph from its edges, by sparse least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from merge.multimap.graph import Cluster, ClusterAlignment, ConsistencyModel, Edge, EdgeTable, is_connected

Poses = Mapping[int, Similarity2]
"""root_from_map between local frames, by the index of the map."""


def optimise_poses(poses: Poses, edges: Sequence[Edge], root: int, fixed_scale: bool) -> dict[int, Similarity2]:
    """Find the poses of least squared error over all edges, whitened by their covariances; the root stays fixed.

    A tree of edges keeps its poses. Source: Lu and Milios 1997; for grid maps, Jiang et al. 2019. SciPy's trust region
    solves it with a sparse Jacobian.
    """
    from scipy.optimize import least_squares  # only teams need it

    if len(edges) < len(poses):
        return dict(poses)
    system = _System.of(poses, edges, root, fixed_scale)
    start = pack_poses(poses, system.free, system.unknowns)
    found = least_squares(system.residuals, start, system.jacobian, x_scale="jac", tr_solver="lsmr", max_nfev=30)
    return unpack_poses(found.x, poses, system.free, system.unknowns)


def join_clusters(first: Cluster, second: Cluster, alignment: ClusterAlignment, model: ConsistencyModel) -> Cluster:
    """Make one cluster of two, its poses optimised over all their edges."""
    poses = dict(first.poses)
    poses.update({index: alignment.first_from_second @ pose for index, pose in second.poses.items()})
    edges = (*first.edges, *second.edges, *alignment.edges)
    return Cluster(optimise_poses(poses, edges, min(poses), model.fixed_scale), edges)


def refit_cluster(cluster: Cluster, edges: Sequence[Edge], model: ConsistencyModel) -> Cluster:
    """Optimise a cluster over all edges that agree with its poses, and over no others."""
    for _ in range(model.settings.clustering.refits):
        agreeing = model.agreeing(cluster, edges)
        if not is_connected(cluster, agreeing):
            return cluster
        unchanged = len(agreeing) == len(cluster.edges)
        poses = optimise_poses(cluster.poses, agreeing, cluster.root, model.fixed_scale)
        cluster = Cluster(poses, agreeing)
        if unchanged:
            break
    return cluster


def leave_one_out_residuals(
    poses: Poses, edges: Sequence[Edge], root: int, fixed_scale: bool, min_redundancy: float
) -> NDArray[np.float64]:
    """Return the squared Mahalanobis distance (E,) of each edge from the prediction of all others.

    ``poses`` are the optimum of all edges. An edge of which the others control less than ``min_redundancy`` has 0.
    Source: data snooping, Baarda 1968.
    """
    if len(edges) < len(poses):
        return np.zeros(len(edges))
    system = _System.of(poses, edges, root, fixed_scale)
    at = pack_poses(poses, system.free, system.unknowns)
    blocks = system.blocks(at)
    redundancy = np.eye(system.unknowns) - blocks @ system.end_covariances(at) @ blocks.transpose(0, 2, 1)
    controlled = np.linalg.eigvalsh(redundancy)[:, 0] > min_redundancy
    redundancy[~controlled] = np.eye(system.unknowns)
    error = system.residuals(at).reshape(len(edges), system.unknowns, 1)
    squares = (error * np.linalg.solve(redundancy, error)).sum(axis=(1, 2))
    return np.where(controlled, squares, 0.0)


@dataclass(frozen=True, eq=False)
class _System:
    """Whitened residuals of all edges and their Jacobian by the poses of the ``free`` maps.

    ``start`` holds the poses of the free maps and, last, of the root; ``targets`` and ``sources`` (E,) index it.
    """

    start: Similarity2Array
    free: Sequence[int]
    edges: EdgeTable
    whiteners: NDArray[np.float64]
    targets: NDArray[np.intp]
    sources: NDArray[np.intp]
    unknowns: int

    @staticmethod
    def of(poses: Poses, edges: Sequence[Edge], root: int, fixed_scale: bool) -> _System:
        free = [index for index in sorted(poses) if index != root]
        at = {index: k for k, index in enumerate([*free, root])}
        table, unknowns = EdgeTable.of(edges), 3 if fixed_scale else 4
        targets, sources = (
            np.array([at[index] for index in ends.tolist()], np.intp) for ends in (table.targets, table.sources)
        )
        whiteners = np.linalg.inv(np.linalg.cholesky(table.covariances[:, :unknowns, :unknowns]))
        start = Similarity2Array.of(poses[index] for index in at)
        return _System(start, free, table, whiteners, targets, sources, unknowns)

    def residuals(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        placed = self._placed(values)
        error = (placed[self.targets].inverse() @ placed[self.sources]).minus(self.edges.target_from_source)
        return np.asarray((self.whiteners @ error[:, : self.unknowns, None]).ravel())

    def jacobian(self, values: NDArray[np.float64]) -> csr_array:
        """Return the sparse Jacobian: a block for the target and one for the source of each edge."""
        number, blocks = self.unknowns, self.blocks(values)
        first = np.stack((self.targets, self.sources), axis=-1) * number
        cols = np.broadcast_to((first[:, :, None] + np.arange(number)).reshape(-1, 1, 2 * number), blocks.shape)
        rows = np.broadcast_to(np.arange(len(blocks) * number).reshape(-1, number, 1), blocks.shape)
        moved = cols < number * len(self.free)
        shape = len(blocks) * number, number * len(self.free)
        return csr_array((blocks[moved], (rows[moved], cols[moved])), shape=shape)

    def blocks(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the whitened derivatives (E, U, 2 U) of each edge by the poses of its target and its source."""
        placed = self._placed(values)
        kept = [k for k in range(8) if k % 4 < self.unknowns]
        by_ends = relative_pose_jacobian(placed[self.targets], placed[self.sources])
        return np.asarray(self.whiteners @ by_ends[:, : self.unknowns][:, :, kept])

    def end_covariances(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariances (E, 2 U, 2 U) of the poses of the target and the source of each edge."""
        from scipy.sparse.linalg import splu  # only teams need it

        jacobian, number = self.jacobian(values), self.unknowns
        size = number * len(self.free)
        covariance = np.zeros((size + number,) * 2)  # that of the root is 0
        covariance[:size, :size] = splu((jacobian.T @ jacobian).tocsc()).solve(np.eye(size))
        first = np.stack((self.targets, self.sources), axis=-1) * number
        at = (first[:, :, None] + np.arange(number)).reshape(-1, 2 * number)
        return np.asarray(covariance[at[:, :, None], at[:, None, :]])

    def _placed(self, values: NDArray[np.float64]) -> Similarity2Array:
        rows = values.reshape(len(self.free), self.unknowns)
        scale = np.exp(rows[:, 3]) if self.unknowns == 4 else np.abs(self.start.turn[:-1])
        turn = np.append(scale * np.exp(1j * rows[:, 2]), self.start.turn[-1])
        return Similarity2Array(turn, np.append(rows[:, 0] + 1j * rows[:, 1], self.start.shift[-1]))


def pack_poses(poses: Poses, free: Sequence[int], unknowns: int) -> NDArray[np.float64]:
    """Return x, y, yaw (and log scale) of the free maps, one after the other."""
    rows = [(p.x, p.y, p.yaw, math.log(p.scale))[:unknowns] for p in (poses[index] for index in free)]
    return np.array(rows).ravel()


def unpack_poses(
    values: NDArray[np.float64], poses: Poses, free: Sequence[int], unknowns: int
) -> dict[int, Similarity2]:
    """Invert ``pack_poses``; other maps, and scales that are fixed, are taken from ``poses``."""
    placed = dict(poses)
    for index, row in zip(free, values.reshape(-1, unknowns).tolist(), strict=True):
        scale = math.exp(row[3]) if unknowns == 4 else poses[index].scale
        placed[index] = Similarity2(row[0], row[1], row[2], scale)
    return placed


def relative_pose_jacobian(targets: Similarity2Array, sources: Similarity2Array) -> NDArray[np.float64]:
    """Differentiate x, y, yaw, log scale of target^-1 source by those of the target and of the source: (E, 4, 8)."""
    back = 1.0 / targets.turn
    between = (sources.shift - targets.shift) / targets.turn
    by_target = -Similarity2Array(back, -between).adjoint()
    by_source = Similarity2Array(back, np.zeros_like(between)).adjoint()
    return np.concatenate((by_target, by_source), axis=-1)
