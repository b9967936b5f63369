"""Ends for the robots of a mission, so that what any two of them saw overlaps as wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.robot.robot_log import RobotTruth
from sim.mission.first_seen import NEVER, first_seen
from sim.mission.settings import MissionSettings
from sim.mission.starts import Starts

LEVELS = 60
"""Ends that are tried for each robot, evenly over its time."""
SHORTEST = 0.05
"""No robot's mission is cut to less than this share."""
MARGIN = 0.002
"""How far inside the range an overlap is to lie, if the range is wide enough."""
ROUNDS = 20


@dataclass(frozen=True)
class Cut:
    """How many ``scans`` of each robot to keep, and ``miss``, by how much the overlaps of the pairs then lie outside
    the range, summed up: 0 where all lie in it."""

    scans: tuple[int, ...]
    miss: float


def overlap_cut(
    truths: Sequence[RobotTruth], frame: GridFrame, wanted: tuple[float, float], clear_range: float = 0.0
) -> Cut:
    """The longest missions, each from its beginning, whose footprints on the true raster overlap pair by pair within
    ``wanted``, (least, greatest); where there are none, those that miss it least. ``clear_range`` [m] is how far a beam
    without a return sees.

    All pairs are tabulated over the robots' ends; the ends are then found one robot at a time, from many beginnings.
    """
    scans = [_levels(len(truth.scans)) for truth in truths]
    levels = [
        _seen_at(first_seen(truth, frame, clear_range), counts) for truth, counts in zip(truths, scans, strict=True)
    ]
    misses = {(a, b): _miss(_overlaps(levels[a], levels[b]), wanted) for a, b in combinations(range(len(truths)), 2)}
    tables = {**misses, **{(b, a): table.T for (a, b), table in misses.items()}}
    found = [_descend(tables, len(truths), level) for level in range(LEVELS)]
    miss, _, ends = min(found, key=lambda each: (each[0], each[1]))
    return Cut(tuple(int(counts[end]) for counts, end in zip(scans, ends, strict=True)), miss)


def attempts(settings: MissionSettings) -> tuple[MissionSettings, ...]:
    """What to try for the overlap wanted: the settings as they are, and then the other kinds of starts, close ones
    first where much overlap is wanted. Where no start is to be chosen, there is one attempt."""
    fixed = settings.policy == "replay" or all(robot.start is not None for robot in settings.robots)
    if settings.overlap is None or fixed:
        return (settings,)
    much = sum(settings.overlap) >= 1.0
    order: tuple[Starts, ...] = ("close", "random", "spread") if much else ("spread", "random", "close")
    return (settings, *(replace(settings, starts=how) for how in order if how != settings.starts))


def _levels(scans: int) -> NDArray[np.int64]:
    return np.maximum(1, np.rint(scans * np.linspace(SHORTEST, 1.0, LEVELS))).astype(np.int64)


def _seen_at(first: NDArray[np.int32], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """The lowest level at which each cell has been seen, ``LEVELS`` where never: (cells,)."""
    level = np.searchsorted(counts, first.ravel())
    level[first.ravel() == NEVER] = LEVELS
    return level


def _overlaps(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.float64]:
    """The overlap of two robots that end at each level, (LEVELS, LEVELS): common cells over the smaller footprint."""
    joint = np.bincount(a * (LEVELS + 1) + b, minlength=(LEVELS + 1) ** 2).reshape(LEVELS + 1, LEVELS + 1)
    common = joint[:LEVELS, :LEVELS].cumsum(axis=0).cumsum(axis=1)
    area_a, area_b = joint.sum(axis=1)[:LEVELS].cumsum(), joint.sum(axis=0)[:LEVELS].cumsum()
    shares: NDArray[np.float64] = common / np.maximum(1, np.minimum(area_a[:, None], area_b[None]))
    return shares


def _miss(overlaps: NDArray[np.float64], wanted: tuple[float, float]) -> NDArray[np.float64]:
    margin = min(MARGIN, (wanted[1] - wanted[0]) / 4.0)
    low = wanted[0] + margin if wanted[0] > 0.0 else 0.0
    high = wanted[1] - margin if wanted[1] < 1.0 else 1.0
    return np.maximum(0.0, np.maximum(low - overlaps, overlaps - high))


def _descend(
    tables: dict[tuple[int, int], NDArray[np.float64]], robots: int, level: int
) -> tuple[float, int, tuple[int, ...]]:
    """The miss, how much was cut, and the ends, from where all robots end at one level."""
    ends = [level] * robots
    for _ in range(ROUNDS):
        before = list(ends)
        for robot in range(robots):
            miss = sum(tables[robot, other][:, ends[other]] for other in range(robots) if other != robot)
            ends[robot] = LEVELS - 1 - int(np.argmin(np.round(np.asarray(miss)[::-1], 9)))
        if ends == before:
            break
    total = sum(float(tables[a, b][ends[a], ends[b]]) for a, b in combinations(range(robots), 2))
    return round(total, 9), robots * LEVELS - sum(ends), tuple(ends)
