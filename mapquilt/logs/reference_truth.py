"""The truth of maps that were drawn from parts of one log, by its reference poses."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.beam_endpoints import beam_endpoints
from mapping.ground_truth.coarse_footprint import CoarseFootprint
from mapping.ground_truth.footprint import TRUE_RESOLUTION, footprint, observed
from mapping.ground_truth.truth import PairOverlap, PairTruth, map_truth, pair_truth
from mapping.robot.robot_log import RobotTruth
from mapping.robot.trajectory import Trajectory
from mapquilt.logs.log_map import LogMap
from mapquilt.runs.truth_file import RobotOrigin, RunTruth


@dataclass(frozen=True, eq=False)
class ReferenceTruth:
    """Truth of maps in one reference frame: ``world`` is the raster of all scans at their reference poses, and
    ``footprints`` are the parts of it that each map observed, by name."""

    truth: RunTruth
    world: OccupancyGrid
    footprints: dict[str, OccupancyGrid]


def share_a_reference(maps: Sequence[LogMap]) -> bool:
    """Return whether the maps are of one log or run, all with reference poses, which then are of one frame."""
    return len({one.path for one in maps}) == 1 and all(one.recorded.reference is not None for one in maps)


def reference_steps(maps: int) -> int:
    """Return the number of steps of ``reference_truth``: each map and each pair."""
    return maps + maps * (maps - 1) // 2


def reference_truth(maps: Sequence[LogMap], on_step: Callable[[], None] = lambda: None) -> ReferenceTruth:
    """Fit the truth of maps and pairs as for simulated runs, with the reference poses for true ones.

    The readings are taken for true ranges: a real log has no better ones. So the truth is as exact as the reference,
    which errs by centimetres in corrected logs. ``on_step`` is called ``reference_steps`` times. Raises
    ``ValueError`` if a map lacks the reference, or no beam hit anything.
    """
    known = [(one, _truth(one)) for one in maps]
    world = _raster([truth for _, truth in known])
    footprints, ends, robots = {}, {}, []
    for one, truth in known:
        clear_range = one.settings.clear_range
        footprints[one.name] = footprint(world, observed(truth, world.frame, clear_range))
        ends[one.name] = beam_endpoints(one.recorded.log, truth, one.result.trajectory, np.zeros_like(truth.hits_robot))
        start = truth.trajectory.pose(0)
        robots.append(RobotOrigin(one.name, start, Similarity2(), map_truth(ends[one.name], start, Similarity2())))
        on_step()
    coarse = {name: CoarseFootprint.of(grid) for name, grid in footprints.items()}
    pairs: dict[tuple[str, str], PairTruth] = {}
    for a, b in itertools.combinations(footprints, 2):
        overlap = PairOverlap.of(footprints[a], footprints[b], (coarse[a], coarse[b]))
        pairs[a, b] = pair_truth(ends[a], ends[b], Similarity2(), Similarity2(), overlap)
        on_step()
    return ReferenceTruth(RunTruth(tuple(robots), pairs), world, footprints)


def _truth(one: LogMap) -> RobotTruth:
    log = one.recorded.log
    hits_robot = np.zeros((len(log.scans), log.scans[0].ranges.size), np.bool_)
    return RobotTruth(log.scans, _reference(one), hits_robot, log.base_from_lidar)


def _reference(one: LogMap) -> Trajectory:
    if one.recorded.reference is None:
        raise ValueError(f"{one.path}: has no reference poses, so the truth of {one.name} is not known")
    return one.recorded.reference


def _raster(truths: Sequence[RobotTruth]) -> OccupancyGrid:
    mapper = LogOddsMapper(TRUE_RESOLUTION)
    for truth in truths:
        for k, scan in enumerate(truth.scans):
            mapper.integrate(scan, truth.trajectory.pose(k) @ truth.base_from_lidar)
    return mapper.grid()
