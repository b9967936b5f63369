"""Errors of a trajectory: absolute, relative, and over relations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.ground_truth.truth import fit_rigid
from mapping.io.relations_file import Relations
from mapping.robot.trajectory import Trajectory

MAX_DIFFERENCE = 0.02
"""Poses of two trajectories belong together if their stamps differ by less [s], as in the TUM RGB-D benchmark."""

RELATION_DIFFERENCE = 0.001
"""The same for stamps of relations [s], which are stamps of the log itself."""

Unit = Literal["m", "s"]


@dataclass(frozen=True)
class Spread:
    """Statistics of errors that are not negative. The deviation is that of the population."""

    rmse: float
    mean: float
    median: float
    max: float
    std: float

    @staticmethod
    def of(errors: NDArray[np.float64]) -> Spread:
        """Summarise errors (N,), N > 0."""
        return Spread(
            rmse=float(np.sqrt(np.mean(errors**2))),
            mean=float(errors.mean()),
            median=float(np.median(errors)),
            max=float(errors.max()),
            std=float(errors.std()),
        )


@dataclass(frozen=True, eq=False)
class AbsoluteError:
    """Distances of an estimate to the reference after the best rigid motion.

    ``stamps`` (N,), ``estimate`` (N, 3) moved onto the ``reference`` (N, 3), and errors (N,) of ``position`` [m] and
    ``yaw`` [rad].
    """

    reference_from_estimate: SE2
    stamps: NDArray[np.float64]
    estimate: NDArray[np.float64]
    reference: NDArray[np.float64]
    position: NDArray[np.float64]
    yaw: NDArray[np.float64]


@dataclass(frozen=True)
class MotionError:
    """Errors of ``pairs`` of motions: ``translation`` [m] and ``rotation`` [rad]."""

    pairs: int
    translation: Spread
    rotation: Spread


@dataclass(frozen=True)
class RelativeError:
    """Errors of all motions over a window of ``length`` metres of the reference path or seconds; None if it has
    none so long."""

    length: float
    unit: Unit
    error: MotionError | None


def matched(
    estimate: Trajectory, reference: Trajectory, max_difference: float = MAX_DIFFERENCE
) -> tuple[Trajectory, Trajectory]:
    """Return the poses of both trajectories whose stamps belong together, each used once.

    Each pose of the estimate takes the reference nearest in time; of several with one reference the nearest remains.
    Raises ``ValueError`` if fewer than two are left.
    """
    nearest = _nearest(reference.stamps, estimate.stamps)
    difference = np.abs(reference.stamps[nearest] - estimate.stamps)
    order = np.lexsort((difference, nearest))
    order = order[difference[order] <= max_difference]
    _, first = np.unique(nearest[order], return_index=True)
    chosen = order[first]
    if len(chosen) < 2:
        raise ValueError(
            f"{len(chosen)} poses within {max_difference:g} s of the reference, must be at least 2: the estimate runs "
            f"from {estimate.stamps[0]} to {estimate.stamps[-1]} s, the reference from {reference.stamps[0]} to "
            f"{reference.stamps[-1]} s"
        )
    return _select(estimate, chosen), _select(reference, nearest[chosen])


def _nearest(stamps: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.int64]:
    right = np.clip(np.searchsorted(stamps, wanted), 1, max(len(stamps) - 1, 1))
    if len(stamps) == 1:
        return np.zeros(len(wanted), np.int64)
    return np.where(wanted - stamps[right - 1] <= stamps[right] - wanted, right - 1, right)


def _select(trajectory: Trajectory, rows: NDArray[np.int64]) -> Trajectory:
    return Trajectory(trajectory.stamps[rows], trajectory.poses[rows])


def absolute_error(estimate: Trajectory, reference: Trajectory) -> AbsoluteError:
    """Measure an estimate against the reference, pose by pose, after the rigid motion that fits the positions best.

    Both have as many poses, of the same times (``matched``). Source: Sturm et al. 2012, "A benchmark for the
    evaluation of RGB-D SLAM systems", equation 2, in the plane; the fit is Umeyama 1991 without scale.
    """
    motion = fit_rigid(estimate.poses[:, :2], reference.poses[:, :2])
    moved = estimate.moved(motion).poses
    return AbsoluteError(
        reference_from_estimate=motion,
        stamps=reference.stamps,
        estimate=moved,
        reference=reference.poses,
        position=np.hypot(*(moved - reference.poses)[:, :2].T),
        yaw=np.abs(_wrapped(moved[:, 2] - reference.poses[:, 2])),
    )


def relative_error(estimate: Trajectory, reference: Trajectory, length: float, unit: Unit) -> RelativeError:
    """Compare the motions of all windows of one length.

    A window leads from each pose to the first one that is at least ``length`` later: metres along the reference path,
    or seconds. Its error is ``(first_from_last of the reference)^-1 @ first_from_last of the estimate``. Source: Sturm
    et al. 2012, equation 1, for seconds; Geiger et al. 2012, "Are we ready for autonomous driving?", section 3.1, for
    metres.
    """
    steps = np.hypot(*np.diff(reference.poses[:, :2], axis=0).T)
    along = np.concatenate(([0.0], np.cumsum(steps))) if unit == "m" else reference.stamps
    last = np.searchsorted(along, along + length * (1.0 - 1e-9))
    first = np.flatnonzero(last < len(along))
    if not first.size:
        return RelativeError(length, unit, None)
    last = last[first]
    true = _motions(reference.poses[first], reference.poses[last])
    return RelativeError(length, unit, _motion_error(true, _motions(estimate.poses[first], estimate.poses[last])))


def relations_error(estimate: Trajectory, relations: Relations) -> MotionError:
    """Compare the estimate's motions with known relations.

    A relation counts if the estimate has a pose within a millisecond of both of its stamps. Source: Kuemmerle et al.
    2009, "On measuring the accuracy of SLAM algorithms", equation 3; translation and rotation apart, absolute values.
    Raises ``ValueError`` if no relation counts.
    """
    rows = np.stack([_nearest(estimate.stamps, stamps) for stamps in relations.stamps.T], axis=-1)
    difference = np.abs(estimate.stamps[rows] - relations.stamps).max(axis=1)
    # stamps of 1e9 s have a resolution of 2e-7 s in double precision
    known = np.flatnonzero(difference <= RELATION_DIFFERENCE + 1e-6)
    if not known.size:
        near = f"within {RELATION_DIFFERENCE:g} s of poses of the estimate"
        raise ValueError(f"none of {len(difference)} relations has both stamps {near}")
    first, last = rows[known].T
    return _motion_error(relations.first_from_second[known], _motions(estimate.poses[first], estimate.poses[last]))


def _motion_error(true: NDArray[np.float64], estimated: NDArray[np.float64]) -> MotionError:
    error = _motions(true, estimated)
    return MotionError(len(error), Spread.of(np.hypot(error[:, 0], error[:, 1])), Spread.of(np.abs(error[:, 2])))


def _motions(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``first^-1 @ second`` of poses (N, 3) each, as poses (N, 3)."""
    c, s = np.cos(first[:, 2]), np.sin(first[:, 2])
    x, y = (second - first)[:, :2].T
    return np.column_stack((c * x + s * y, c * y - s * x, _wrapped(second[:, 2] - first[:, 2])))


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    wrapped: NDArray[np.float64] = np.remainder(angles + math.pi, math.tau) - math.pi
    return wrapped
