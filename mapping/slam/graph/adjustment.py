"""Bundle adjustment of walls: keyframe poses and the lines that they see, optimised together.

Each surfel that is a line has two unknowns, its angle and its offset. They are eliminated (Schur complement), which
leaves a dense system in the keyframes that saw a wall together. Compare BALM (Liu and Zhang, RA-L 2021) in space.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.slam.graph.pose_graph import linearised
from mapping.slam.linear_algebra import solve_upper
from mapping.slam.link import Link
from mapping.slam.planar import between, move_points, turn_each, turn_vectors
from mapping.slam.settings import SlamSettings
from mapping.slam.tracking.matching import last_reach, nearest_surfel
from mapping.slam.tracking.motion import motion_covariance
from mapping.slam.tracking.surfels import SurfelMap, surfel_map
from mapping.slam.tracking.tracker import Tracker

FIXED = 1e10
"""Information that keeps the first pose in its place."""

DAMPING = 1e-6
"""Added to the information of a line, whose turn a single point does not show."""


@dataclass(frozen=True, eq=False)
class GroupedPoints:
    """Points of scans in the frames of their nodes: ``points`` and ``normals`` (N, 2), ``deviations`` (N,), and the
    node of each, ``owners`` (N,)."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    deviations: NDArray[np.float64]
    owners: NDArray[np.int64]

    def placed(self, poses: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points and normals in the frame of the poses (K, 3)."""
        turned = turn_each(poses[self.owners, 2], self.points)
        return turned + poses[self.owners, :2], turn_each(poses[self.owners, 2], self.normals)


def adjust(
    tracker: Tracker, poses: NDArray[np.float64], settings: SlamSettings
) -> tuple[NDArray[np.float64], SurfelMap | None]:
    """Optimise keyframe poses (K, 3) and the walls that they see; return the poses and the surfels of the whole map.

    Unknowns are the poses of every g-th keyframe, g being 1 but in long logs; those between move rigidly with them.
    Odometry links neighbours.
    """
    keyframes = tracker.track.keyframes
    group = -(-len(keyframes) // settings.adjustment.nodes)
    nodes = _nodes(tracker, group)
    grouped = _grouped(tracker, poses, nodes, settings)
    odometry = _odometry_links(tracker, nodes)
    solved = poses[nodes]
    surfels = None
    for _ in range(settings.adjustment.rounds):
        surfels = surfel_map(*grouped.placed(solved), tracker.voxel, settings.local_map)
        if surfels is None or len(nodes) < 2:
            break
        solved = _solve_round(grouped, solved, surfels, odometry, settings)
    surfels = surfel_map(*grouped.placed(solved), tracker.voxel, settings.local_map)
    return moved_with_nodes(poses, nodes, solved), surfels


def _nodes(tracker: Tracker, group: int) -> NDArray[np.int64]:
    """Choose every ``group``-th keyframe of each log, its first one among them."""
    scans = [keyframe.scan for keyframe in tracker.track.keyframes]
    bounds = np.searchsorted(scans, tracker.starts).tolist()
    return np.concatenate([np.arange(a, b, group) for a, b in itertools.pairwise(bounds)])


def moved_with_nodes(
    poses: NDArray[np.float64], nodes: NDArray[np.int64], solved: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Move poses (N, 3) with the nodes before and after them, whose indices are ``nodes`` (K,) and new poses ``solved``
    (K, 3): the nearer a node, the more of its motion counts."""
    index = np.clip(np.searchsorted(nodes, np.arange(len(poses)), side="right") - 1, 0, len(nodes) - 1)
    after = np.minimum(index + 1, len(nodes) - 1)
    a = _carried(poses, poses[nodes[index]], solved[index])
    b = _carried(poses, poses[nodes[after]], solved[after])
    span = np.maximum(nodes[after] - nodes[index], 1)
    weight = ((np.arange(len(poses)) - nodes[index]) / span)[:, None]
    off = b - a
    off[:, 2] = [math.remainder(yaw, math.tau) for yaw in off[:, 2].tolist()]
    moved: NDArray[np.float64] = a + weight * off
    return moved


def _carried(poses: NDArray[np.float64], old: NDArray[np.float64], new: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return new @ old^-1 @ poses, row by row."""
    turn = new[:, 2] - old[:, 2]
    moved = np.empty_like(poses)
    moved[:, :2] = new[:, :2] + turn_each(turn, poses[:, :2] - old[:, :2])
    moved[:, 2] = poses[:, 2] + turn
    return moved


def _grouped(
    tracker: Tracker, poses: NDArray[np.float64], nodes: NDArray[np.int64], settings: SlamSettings
) -> GroupedPoints:
    """Collect the points of evenly chosen scans of each node, in its frame."""
    track = tracker.track
    first = np.searchsorted(track.owners, nodes)
    last = np.append(first[1:], len(track.owners))
    parts: list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]] = []
    scans_of = moved_scans(tracker, poses)
    for number, (start, stop) in enumerate(zip(first.tolist(), last.tolist(), strict=True)):
        count = min(settings.adjustment.scans, stop - start)
        for index in np.unique(np.linspace(start, stop - 1, count).astype(np.int64)).tolist():
            scan = tracker.points_of(index)
            pose = between(poses[nodes[number]], scans_of[index])
            owners = np.full(len(scan.points), number)
            parts.append((move_points(pose, scan.points), turn_vectors(pose[2], scan.normals), scan.deviations, owners))
    return GroupedPoints(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def moved_scans(tracker: Tracker, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the poses (N, 3) of all scans, moved with their keyframes."""
    nodes = np.array([keyframe.scan for keyframe in tracker.track.keyframes])
    return moved_with_nodes(tracker.track.poses, nodes, poses)


def _odometry_links(tracker: Tracker, nodes: NDArray[np.int64]) -> list[Link]:
    """Link neighbouring nodes by odometry, which may have slipped; without it, loosely by the track."""
    keyframes, motion, links = tracker.track.keyframes, tracker.settings.motion, []
    level = tracker.noise.level if motion.odometry else motion.greatest_level
    for number, (a, b) in enumerate(zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True)):
        path = sum(keyframe.path for keyframe in keyframes[a + 1 : b + 1])
        turned = sum(keyframe.turned for keyframe in keyframes[a + 1 : b + 1])
        relative = between(tracker.odometry[keyframes[a].scan], tracker.odometry[keyframes[b].scan])
        covariance = level**2 * motion_covariance(path, turned, motion)
        links.append(Link(number, number + 1, relative, covariance, robust=True))
    return links


def _solve_round(
    grouped: GroupedPoints,
    poses: NDArray[np.float64],
    surfels: SurfelMap,
    odometry: Sequence[Link],
    settings: SlamSettings,
) -> NDArray[np.float64]:
    """Assign the points to lines, and optimise."""
    match = settings.match
    lines = _associate(*grouped.placed(poses), surfels, last_reach(surfels.voxel, match))
    order = np.lexsort((grouped.owners, lines))
    order = order[lines[order] >= 0]
    points, deviations, owners = grouped.points[order], grouped.deviations[order], grouped.owners[order]
    for _ in range(settings.adjustment.steps):
        hessian, gradient = _line_equations(
            points,
            deviations,
            owners,
            lines[order],
            poses,
            surfels.means,
            surfels.normals,
            match.outlier_deviations,
            settings.local_map.roughness,
        )
        _add_links(hessian, gradient, poses, odometry, settings.loops.robust_deviations)
        hessian[np.arange(3), np.arange(3)] += FIXED
        step = solve_upper(hessian, -gradient)
        poses = poses + step.reshape(-1, 3)
    return poses


def _add_links(
    hessian: NDArray[np.float64],
    gradient: NDArray[np.float64],
    poses: NDArray[np.float64],
    links: Sequence[Link],
    robust_deviations: float,
) -> None:
    """Add the links between neighbours to the upper triangle of the normal equations."""
    blocks, pull = linearised(poses, links, robust_deviations)
    gradient += pull
    for link, block in zip(links, blocks, strict=True):
        a, b = slice(3 * link.first, 3 * link.first + 3), slice(3 * link.second, 3 * link.second + 3)
        hessian[a, a] += block[0, 0]
        hessian[b, b] += block[1, 1]
        hessian[a, b] += block[0, 1]


@njit(cache=True)
def _associate(
    points: NDArray[np.float64], normals: NDArray[np.float64], surfels: SurfelMap, reach: float
) -> NDArray[np.int64]:
    """Return the nearest line of each point, -1 where there is none."""
    chosen = np.full(points.shape[0], -1, np.int64)
    for k in range(points.shape[0]):
        surfel = nearest_surfel(surfels, points[k, 0], points[k, 1], normals[k, 0], normals[k, 1], reach)
        if surfel >= 0 and surfels.variances[surfel] > 0.0:
            chosen[k] = surfel
    return chosen


@njit(cache=True)
def _line_equations(
    points: NDArray[np.float64],
    deviations: NDArray[np.float64],
    owners: NDArray[np.int64],
    lines: NDArray[np.int64],
    poses: NDArray[np.float64],
    means: NDArray[np.float64],
    normals: NDArray[np.float64],
    outlier: float,
    roughness: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the upper triangle of the normal equations (3 K, 3 K) and the gradient (3 K,) of poses (K, 3), after the
    elimination of the lines.

    ``points`` (N, 2) are in the frame of their owner; they are sorted by line, then by owner.
    """
    count = poses.shape[0]
    hessian, gradient = np.zeros((3 * count, 3 * count)), np.zeros(3 * count)
    seen = np.empty(count, np.int64)
    own, mixed, pull = np.empty((count, 3, 3)), np.empty((count, 3, 2)), np.empty((count, 3))
    block, force = np.empty((2, 2)), np.empty(2)
    start, total = 0, lines.size
    while start < total:
        line = lines[start]
        stop = start
        while stop < total and lines[stop] == line:
            stop += 1
        number, last = 0, -1
        block[:], force[:] = 0.0, 0.0
        for i in range(start, stop):
            owner = owners[i]
            if owner != last:
                seen[number] = last = owner
                own[number], mixed[number], pull[number] = 0.0, 0.0, 0.0
                number += 1
            k = number - 1
            noise = deviations[i] ** 2 + roughness**2
            wall = means[line], normals[line]
            _add_point(points[i], poses[owner], wall, noise, outlier, own[k], mixed[k], pull[k], block, force)
        start = stop
        if number > 1:
            _eliminate(hessian, gradient, seen[:number], own, mixed, pull, block, force)
    return hessian, gradient


@njit(cache=True)
def _add_point(
    point: NDArray[np.float64],
    pose: NDArray[np.float64],
    wall: tuple[NDArray[np.float64], NDArray[np.float64]],
    noise: float,
    outlier: float,
    own: NDArray[np.float64],
    mixed: NDArray[np.float64],
    pull: NDArray[np.float64],
    block: NDArray[np.float64],
    force: NDArray[np.float64],
) -> None:
    """Add the distance of a point from its line to the equations of the pose, ``own`` (3, 3) and ``pull`` (3,), of the
    line, ``block`` (2, 2) and ``force`` (2,), and of both, ``mixed`` (3, 2).

    ``wall`` is the line's mean (2,) and normal (2,); its unknowns are a turn about the mean, and a shift along the
    normal. ``noise`` [m^2] is the variance of the distance.
    """
    mean, normal = wall
    c, s = math.cos(pose[2]), math.sin(pose[2])
    rx, ry = c * point[0] - s * point[1], s * point[0] + c * point[1]
    dx, dy = pose[0] + rx - mean[0], pose[1] + ry - mean[1]
    nx, ny = normal[0], normal[1]
    error = nx * dx + ny * dy
    squared = error * error / noise
    weight = 1.0 / (1.0 + squared / (outlier * outlier)) ** 2 / noise
    of_pose = (nx, ny, ny * rx - nx * ry)
    of_line = (ny * dx - nx * dy, -1.0)
    for u in range(3):
        for v in range(u, 3):
            own[u, v] += weight * of_pose[u] * of_pose[v]
        for v in range(2):
            mixed[u, v] += weight * of_pose[u] * of_line[v]
        pull[u] += weight * of_pose[u] * error
    for u in range(2):
        for v in range(2):
            block[u, v] += weight * of_line[u] * of_line[v]
        force[u] += weight * of_line[u] * error


@njit(cache=True)
def _eliminate(
    hessian: NDArray[np.float64],
    gradient: NDArray[np.float64],
    seen: NDArray[np.int64],
    own: NDArray[np.float64],
    mixed: NDArray[np.float64],
    pull: NDArray[np.float64],
    block: NDArray[np.float64],
    force: NDArray[np.float64],
) -> None:
    """Add what a line says of the poses ``seen`` (M,) to the equations, without its own unknowns (Schur complement)."""
    a, b, d = block[0, 0] + DAMPING, block[0, 1], block[1, 1] + DAMPING
    determinant = a * d - b**2
    i00, i01, i11 = d / determinant, -b / determinant, a / determinant
    for p in range(seen.size):
        k = 3 * seen[p]
        for u in range(3):
            for v in range(u, 3):
                hessian[k + u, k + v] += own[p, u, v]
            m0 = mixed[p, u, 0] * i00 + mixed[p, u, 1] * i01
            m1 = mixed[p, u, 0] * i01 + mixed[p, u, 1] * i11
            gradient[k + u] += pull[p, u] - m0 * force[0] - m1 * force[1]
            for q in range(p, seen.size):
                j = 3 * seen[q]
                for v in range(3):
                    hessian[k + u, j + v] -= m0 * mixed[q, v, 0] + m1 * mixed[q, v, 1]
