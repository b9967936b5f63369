"""Compute how much of the world a team has seen over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.ground_truth.footprint import TRUE_RESOLUTION
from sim.mission.first_seen import NEVER, first_seen
from sim.mission.mission import Mission
from worlds.raster import touched_cells, true_raster

STEP = 1.0
"""Time between two samples [s]."""


@dataclass(frozen=True, eq=False)
class Coverage:
    """Hold the seen fraction of the true free area at ``stamps`` (T,) [s], per robot (R, T) and for the ``team`` (T,).

    ``free_area`` [m^2] is the whole true free area.
    """

    stamps: NDArray[np.float64]
    robots: NDArray[np.float64]
    team: NDArray[np.float64]
    free_area: float

    def __post_init__(self) -> None:
        for name in ("stamps", "robots", "team"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), np.float64))


def coverage(mission: Mission, clear_range: float = 0.0) -> Coverage:
    """Compute the coverage of a mission second by second, from the true beams, on true cells of 0.05 m.

    A cell is free if no solid touches it and it lies within the fence, if there is one. ``clear_range`` [m] is how far
    a beam without a return sees. The coverage of a robot stays constant after its last scan.
    """
    raster = true_raster(mission.world, TRUE_RESOLUTION)
    free = raster.free
    if mission.world.fence is not None:
        free = free & touched_cells([mission.world.fence], TRUE_RESOLUTION, raster.frame.shape)
    whole = max(1, int(free.sum()))
    end = max(float(truth.trajectory.stamps[-1]) for truth in mission.robots)
    stamps = np.append(np.arange(0.0, end, STEP), end)
    when = []
    for truth in mission.robots:
        scans = first_seen(truth, raster.frame, clear_range)[free]
        seen = scans != NEVER
        when.append(np.where(seen, truth.trajectory.stamps[np.where(seen, scans, 1) - 1], np.inf))
    robots = np.array([_counts(each, stamps) for each in when]) / whole
    team = _counts(np.minimum.reduce(when), stamps) / whole
    return Coverage(stamps, robots, team, whole * TRUE_RESOLUTION**2)


def _counts(when: NDArray[np.float64], stamps: NDArray[np.float64]) -> NDArray[np.int64]:
    """Count the cells that were seen by each of the stamps."""
    return np.searchsorted(np.sort(when), stamps + 1e-9, side="right")
