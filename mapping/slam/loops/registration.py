"""Registration of two sub-maps that may show one place, with the evidence by which a loop is accepted or refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.slam.correlation import (
    LikelihoodField,
    angle_step,
    correlate,
    likelihood_field,
    peaks,
    search_angles,
    thinned,
)
from mapping.slam.linear_algebra import inverse
from mapping.slam.link import Link
from mapping.slam.loops.visibility import count_agreement, free_space
from mapping.slam.planar import between, compose, move_points, turn_vectors
from mapping.slam.result import LoopEvidence
from mapping.slam.settings import LoopSettings, SlamSettings
from mapping.slam.tracking.matching import Match, match_scan
from mapping.slam.tracking.points import ScanPoints
from mapping.slam.tracking.surfels import surfel_map

FEWEST_POINTS = 20
"""Smaller sub-maps fit anywhere."""

QUERY_POINTS = 400
"""Points of the query that the search uses."""

HIT_TOLERANCE = 0.15
"""Distance from a wall [m] within which a point hits it: a wall's cell and the noise of a usual lidar."""

LARGEST_VARIANCE = 1000.0
"""Variance of a registration [m^2, rad^2] beyond which it says nothing."""

START_DEVIATIONS = (0.3, 0.3, 0.1)
"""Standard deviations of the place that the correlation found [m, m, rad]."""

Place = tuple[float, NDArray[np.float64]]
"""A pose (3,) and its likelihood."""


@dataclass(frozen=True, eq=False)
class SubMap:
    """Points of some keyframes in the frame of one of them; ``origins`` (N, 2) are the positions of their lidar."""

    scan: ScanPoints
    origins: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Two keyframes that may show one place, and the predicted ``relative`` pose (3,) of ``second`` in the frame of
    ``first`` with its covariance (3, 3)."""

    first: int
    second: int
    relative: NDArray[np.float64]
    covariance: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Loop:
    """A registered candidate: its link, its evidence, and the name of the test that refused it, or None."""

    link: Link
    evidence: LoopEvidence
    refused: str | None


def sub_map(
    frames: Sequence[int],
    middle: int,
    pose_of: Callable[[int], NDArray[np.float64]],
    points_of: Callable[[int], ScanPoints],
    base_from_lidar: NDArray[np.float64],
) -> SubMap:
    """Join the points of keyframes in the frame of keyframe ``middle``."""
    points, normals, deviations, origins = [], [], [], []
    for frame in frames:
        pose, scan = between(pose_of(middle), pose_of(frame)), points_of(frame)
        points.append(move_points(pose, scan.points))
        normals.append(turn_vectors(pose[2], scan.normals))
        deviations.append(scan.deviations)
        origins.append(np.tile(compose(pose, base_from_lidar)[:2], (len(scan.points), 1)))
    joined = ScanPoints(np.concatenate(points), np.concatenate(normals), np.concatenate(deviations))
    return SubMap(joined, np.concatenate(origins))


def register(
    query: SubMap, target: SubMap, candidate: Candidate, voxel: float, level: float, settings: SlamSettings
) -> Loop | None:
    """Register the query to the target, near the candidate's prediction; None if that finds no place.

    ``voxel`` [m] is the side of the surfels, ``level`` the noise level of the odometry.
    """
    loops = settings.loops
    if min(len(query.scan.points), len(target.scan.points)) < FEWEST_POINTS:
        return None
    coarse = likelihood_field(target.scan.points, loops.cell, loops.cell, 1.0)
    fine = likelihood_field(target.scan.points, loops.cell / 2.0, loops.cell / 2.0, 1.0)
    points = thinned(query.scan.points, loops.cell, QUERY_POINTS)
    places = _refined(fine, points, _search(coarse, points, candidate, loops), loops)
    if not places or places[0][0] <= 0.0:
        return None
    match = _matched(query.scan, target.scan, places[0][1], voxel, settings)
    information = loops.information * match.information
    spread = inverse(information)
    if not 0.0 < spread.diagonal().min() <= spread.diagonal().max() < LARGEST_VARIANCE:
        return None
    least = level**2 * np.diag(np.square([loops.deviation, loops.deviation, loops.yaw_deviation]))
    covariance = spread + least
    overlap, agreement = _agreement(query, target, match.pose, fine, voxel / settings.local_map.voxel_deviations)
    beside = _beside(fine, query.scan.points, match.pose, information, loops)
    evidence = LoopEvidence(overlap, agreement, max(_runner_up(places, loops), beside))
    link = Link(candidate.first, candidate.second, match.pose, covariance, robust=True)
    return Loop(link, evidence, _refusal(evidence, covariance, loops))


def _search(
    field: LikelihoodField, points: NDArray[np.float64], candidate: Candidate, settings: LoopSettings
) -> list[Place]:
    """Correlate over the window of the prediction; return the best places, apart from one another."""
    spread = settings.deviations * np.sqrt(np.diag(candidate.covariance))
    reach = float(np.clip(max(spread[0], spread[1]), *settings.shift))
    angles = search_angles(float(np.clip(spread[2], *settings.turn)), angle_step(points, settings.cell))
    scores = correlate(field, points, candidate.relative, reach, angles)
    found = peaks(scores, settings.cell, angles, (settings.apart, settings.apart_turn), settings.peaks)
    return [(score, candidate.relative + shift) for score, shift in found]


def _refined(
    field: LikelihoodField, points: NDArray[np.float64], places: list[Place], settings: LoopSettings
) -> list[Place]:
    """Search around each place in finer steps; return the best first."""
    step = angle_step(points, field.cell)
    angles = search_angles(2.0 * step, step)
    refined: list[Place] = []
    for _, pose in places:
        scores = correlate(field, points, pose, 2.0 * field.cell, angles)
        found = peaks(scores, field.cell, angles, (settings.apart, settings.apart_turn), 1)
        refined.extend((score, pose + shift) for score, shift in found)
    return sorted(refined, key=lambda place: -place[0])


def _matched(
    query: ScanPoints, target: ScanPoints, start: NDArray[np.float64], voxel: float, settings: SlamSettings
) -> Match:
    surfels = surfel_map(target.points, target.normals, voxel, settings.local_map)
    prior = np.diag(1.0 / np.square(START_DEVIATIONS))
    return match_scan(query, surfels, start, (start, prior), settings.match)


def _runner_up(places: list[Place], settings: LoopSettings) -> float:
    """Return the likelihood of the best place apart from the first, relative to it."""
    best, start = places[0]
    others = [
        score
        for score, pose in places[1:]
        if math.hypot(*(pose - start)[:2]) > settings.apart
        or abs(math.remainder(pose[2] - start[2], math.tau)) > settings.apart_turn
    ]
    return max(others, default=0.0) / best


def _beside(
    field: LikelihoodField,
    points: NDArray[np.float64],
    pose: NDArray[np.float64],
    information: NDArray[np.float64],
    settings: LoopSettings,
) -> float:
    """Return the likelihood ``apart`` [m] from a pose in its least certain direction, relative to the pose's own.

    It is near 1 where a corridor shows no feature, and any place along it fits as well.
    """
    off = information[0, 0] - information[1, 1]
    direction = 0.5 * (math.atan2(2.0 * information[0, 1], off) + math.pi)
    shift = settings.apart * np.array([math.cos(direction), math.sin(direction), 0.0])
    own, *others = (_total_likelihood(field, move_points(pose + sign * shift, points)) for sign in (0.0, -1.0, 1.0))
    return max(others) / own if own > 0.0 else 1.0


def _agreement(
    query: SubMap, target: SubMap, pose: NDArray[np.float64], field: LikelihoodField, deviation: float
) -> tuple[float, float]:
    """Return the overlap, and the smaller of both directions' agreement, at a pose."""
    tolerance = max(HIT_TOLERANCE, 2.0 * deviation)
    hits, passed = _counts(query, target, pose, field, tolerance)
    reverse = likelihood_field(query.scan.points, field.cell, field.cell, 1.0)
    hits_back, passed_back = _counts(target, query, between(pose, np.zeros(3)), reverse, tolerance)
    agreement = min(hits / max(hits + passed, 1), hits_back / max(hits_back + passed_back, 1))
    return max(hits + passed, 1) / len(query.scan.points), agreement


def _counts(
    points: SubMap, other: SubMap, pose: NDArray[np.float64], field: LikelihoodField, tolerance: float
) -> tuple[int, int]:
    space = free_space(other.origins, other.scan.points, field.cell)
    return count_agreement(points.scan.points, pose, field, space, tolerance)


def _total_likelihood(field: LikelihoodField, points: NDArray[np.float64]) -> float:
    cols, rows = np.floor((points - (field.x, field.y)) / field.cell).astype(np.int64).T
    inside = (rows >= 0) & (cols >= 0) & (rows < field.likelihood.shape[0]) & (cols < field.likelihood.shape[1])
    return float(field.likelihood[rows[inside], cols[inside]].sum())


def _refusal(evidence: LoopEvidence, covariance: NDArray[np.float64], settings: LoopSettings) -> str | None:
    """Return the name of the first test that a loop fails, None if it passes all."""
    half, off = 0.5 * (covariance[0, 0] + covariance[1, 1]), 0.5 * (covariance[0, 0] - covariance[1, 1])
    position = math.sqrt(half + math.hypot(off, covariance[0, 1]))
    passed = {
        "overlap": evidence.overlap >= settings.min_submap_overlap,
        "agreement": evidence.agreement >= settings.min_agreement,
        "runner_up": evidence.runner_up <= settings.max_runner_up,
        "position_deviation": position <= settings.max_position_deviation,
    }
    return next((name for name, good in passed.items() if not good), None)
