"""Shorten the missions of a team until its footprints overlap pair by pair by a given fraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mapping.grid.frame import GridFrame
from mapping.robot.robot_log import RobotTruth
from sim.mission.first_seen import NEVER, first_seen
from sim.mission.settings import CutSettings, MissionSettings, Starts


@dataclass(frozen=True)
class StartAttempt:
    """Hold the settings of an attempt at an overlap, and the number of the ``draw`` of its starts."""

    settings: MissionSettings
    draw: int = 0


@dataclass(frozen=True)
class Cut:
    """Hold how many ``scans`` of each robot to keep, and the ``error``: by how much the pairs' overlaps then lie
    outside the range, summed up."""

    scans: tuple[int, ...]
    error: float


def cut_to_overlap(
    truths: Sequence[RobotTruth],
    frame: GridFrame,
    target: tuple[float, float],
    clear_range: float = 0.0,
    settings: CutSettings = CutSettings(),
) -> Cut:
    """Find the longest missions, each from its start, whose footprints overlap pair by pair within ``target``.

    ``target`` is (least, greatest) overlap. If no cut reaches it, the one with the least error is returned. ``frame``
    is the true raster; ``clear_range`` [m] is how far a beam without a return sees. The overlaps of all pairs are
    tabulated over the robots' end times; coordinate descent from many initial values then finds the ends.
    """
    scans = [_level_scans(len(truth.scans), settings) for truth in truths]
    levels = [
        _seen_at(first_seen(truth, frame, clear_range), counts) for truth, counts in zip(truths, scans, strict=True)
    ]
    errors = {
        (a, b): _overlap_error(_overlaps(levels[a], levels[b], settings.levels), target, settings.overlap_margin)
        for a, b in combinations(range(len(truths)), 2)
    }
    tables = {**errors, **{(b, a): table.T for (a, b), table in errors.items()}}
    found = [_descend(tables, len(truths), level, settings) for level in range(settings.levels)]
    error, _, ends = min(found, key=lambda each: (each[0], each[1]))
    return Cut(tuple(int(counts[end]) for counts, end in zip(scans, ends, strict=True)), error)


def start_attempts(settings: MissionSettings) -> tuple[StartAttempt, ...]:
    """List the starts to try for a target overlap.

    Starts that are spread or close stay so, in several draws. Random ones, the default, are tried first, then the other
    kinds, close ones first for large overlaps, and then close ones further and further apart. There is one attempt if
    no overlap is asked for, or all starts are fixed.
    """
    fixed = settings.policy == "replay" or all(robot.start is not None for robot in settings.robots)
    if settings.overlap is None or fixed:
        return (StartAttempt(settings),)
    draws = range(settings.cut.draws)
    if settings.starts != "random":
        return tuple(StartAttempt(settings, draw) for draw in draws)
    much = sum(settings.overlap) >= 1.0
    order: tuple[Starts, ...] = ("random", "close", "spread") if much else ("random", "spread", "close")
    first = tuple(StartAttempt(replace(settings, starts=how)) for how in order)
    return (*first, *(StartAttempt(replace(settings, starts="close"), draw) for draw in draws[1:]))


def _level_scans(scans: int, settings: CutSettings) -> NDArray[np.int64]:
    shares = np.linspace(settings.shortest, 1.0, settings.levels)
    return np.maximum(1, np.rint(scans * shares)).astype(np.int64)


def _seen_at(first: NDArray[np.int32], counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the lowest level at which each cell has been seen, their number for unseen cells: (cells,)."""
    level = np.searchsorted(counts, first.ravel())
    level[first.ravel() == NEVER] = len(counts)
    return level


def _overlaps(a: NDArray[np.int64], b: NDArray[np.int64], levels: int) -> NDArray[np.float64]:
    """Compute the overlap of two robots for each pair of end levels (levels, levels): common cells over the smaller
    footprint."""
    joint = np.bincount(a * (levels + 1) + b, minlength=(levels + 1) ** 2).reshape(levels + 1, levels + 1)
    common = joint[:levels, :levels].cumsum(axis=0).cumsum(axis=1)
    area_a, area_b = joint.sum(axis=1)[:levels].cumsum(), joint.sum(axis=0)[:levels].cumsum()
    shares: NDArray[np.float64] = common / np.maximum(1, np.minimum(area_a[:, None], area_b[None]))
    return shares


def _overlap_error(overlaps: NDArray[np.float64], target: tuple[float, float], margin: float) -> NDArray[np.float64]:
    margin = min(margin, (target[1] - target[0]) / 4.0)
    low = target[0] + margin if target[0] > 0.0 else 0.0
    high = target[1] - margin if target[1] < 1.0 else 1.0
    return np.maximum(0.0, np.maximum(low - overlaps, overlaps - high))


def _descend(
    tables: dict[tuple[int, int], NDArray[np.float64]], robots: int, level: int, settings: CutSettings
) -> tuple[float, int, tuple[int, ...]]:
    """Return the error, the number of levels cut, and the end levels, by coordinate descent from one common level."""
    ends = [level] * robots
    for _ in range(settings.rounds):
        before = list(ends)
        for robot in range(robots):
            error = sum(tables[robot, other][:, ends[other]] for other in range(robots) if other != robot)
            ends[robot] = settings.levels - 1 - int(np.argmin(np.round(np.asarray(error)[::-1], 9)))
        if ends == before:
            break
    total = sum(float(tables[a, b][ends[a], ends[b]]) for a, b in combinations(range(robots), 2))
    return round(total, 9), robots * settings.levels - sum(ends), tuple(ends)
