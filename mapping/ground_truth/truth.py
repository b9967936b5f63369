"""Ground-truth transforms of maps that drift, and what remains of their distortion.

Odometry drift distorts a map, so that no transform fits it exactly. The truth is therefore fitted: the estimated
endpoints of beams to the true ones, with one weight for each true cell. The scale is never fitted, because the frame
perturbation fixes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import Identifiability, identifiability
from mapping.ground_truth.beam_endpoints import BeamEndpoints
from mapping.ground_truth.coarse_footprint import CoarseFootprint

MIN_COMMON_CELLS = 20
"""Fewer common wall cells (a metre of wall) fix no pair; its truth is then composed of those of the two maps."""


@dataclass(frozen=True)
class MapTruth:
    """``world_from_map`` fits the whole map best, ``world_from_start_map`` holds at the robot's start.

    ``distortion`` is the residual of the fit, RMS [m].
    """

    world_from_map: Similarity2
    world_from_start_map: Similarity2
    distortion: float


@dataclass(frozen=True)
class PairOverlap:
    """``overlap`` is the fraction of the smaller footprint that both robots observed, 0 to 1.

    ``identifiability`` states if the two footprints have one right answer.
    """

    overlap: float
    identifiability: Identifiability

    @staticmethod
    def of(
        target: OccupancyGrid, source: OccupancyGrid, coarse: tuple[CoarseFootprint, CoarseFootprint] | None = None
    ) -> PairOverlap:
        """Compare two footprints in one world frame; ``coarse`` are their coarse footprints, if at hand."""
        return PairOverlap(overlap(target.known, source.known), identifiability(target, source, coarse))


@dataclass(frozen=True)
class PairTruth:
    """``target_from_source`` fitted on ``common_cells`` wall cells that both saw, with its ``residual``, RMS [m].

    With too few common cells ``fitted`` is False, the transform is composed of the fits of the two maps, and the
    residual is None. ``footprints`` compares the true footprints, which no noise changes.
    """

    target_from_source: Similarity2
    fitted: bool
    common_cells: int
    residual: float | None
    footprints: PairOverlap


def fit_rigid(source: NDArray[np.float64], target: NDArray[np.float64]) -> SE2:
    """Fit ``target_from_source`` to point pairs, both (N, 2), by least squares.

    Source: Umeyama 1991, equations 40 to 42, with scale 1. One pair alone fixes no rotation: it is then 0.
    Raises ``ValueError`` without pairs.
    """
    if not len(source):
        raise ValueError("fit_rigid: no pair of points")
    centre_source, centre_target = source.mean(axis=0), target.mean(axis=0)
    a, b = source - centre_source, target - centre_target
    yaw = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    shift = centre_target - SE2(0.0, 0.0, yaw).apply(centre_source)
    return SE2(float(shift[0]), float(shift[1]), yaw)


def _rms(moved: NDArray[np.float64], target: NDArray[np.float64]) -> float:
    return math.sqrt(float(((moved - target) ** 2).sum(axis=1).mean()))


def map_truth(endpoints: BeamEndpoints, world_from_start: SE2, start_from_map: Similarity2) -> MapTruth:
    """Fit the true transform of a map to the endpoints of its beams."""
    best = fit_rigid(endpoints.estimated, endpoints.true)
    return MapTruth(
        world_from_map=Similarity2.from_se2(best) @ start_from_map,
        world_from_start_map=Similarity2.from_se2(world_from_start) @ start_from_map,
        distortion=_rms(best.apply(endpoints.estimated), endpoints.true),
    )


def common_rows(a: BeamEndpoints, b: BeamEndpoints) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of a and of b that belong to the same true cells, (N,) each."""
    both = np.concatenate((a.cells, b.cells))
    low = both.min(axis=0)
    width = int(np.ptp(both[:, 1])) + 1
    key_a, key_b = ((cells - low) @ np.array([width, 1]) for cells in (a.cells, b.cells))
    _, rows_a, rows_b = np.intersect1d(key_a, key_b, assume_unique=True, return_indices=True)
    return rows_a, rows_b


def pair_truth(
    target: BeamEndpoints,
    source: BeamEndpoints,
    target_start_from_map: Similarity2,
    source_start_from_map: Similarity2,
    footprints: PairOverlap,
) -> PairTruth:
    """Fit the true transform of a pair to the true cells that both robots saw."""
    rows_t, rows_s = common_rows(target, source)
    fitted = len(rows_t) >= MIN_COMMON_CELLS
    if fitted:
        start_from_start = fit_rigid(source.estimated[rows_s], target.estimated[rows_t])
        residual = _rms(start_from_start.apply(source.estimated[rows_s]), target.estimated[rows_t])
    else:
        start_from_start = fit_rigid(target.estimated, target.true).inverse() @ fit_rigid(source.estimated, source.true)
        residual = None
    return PairTruth(
        target_start_from_map.inverse() @ Similarity2.from_se2(start_from_start) @ source_start_from_map,
        fitted,
        len(rows_t),
        residual,
        footprints,
    )


def overlap(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """Return the commonly observed cells over those of the smaller footprint: 0 to 1."""
    smaller = min(np.count_nonzero(a), np.count_nonzero(b))
    return np.count_nonzero(a & b) / smaller if smaller else 0.0
