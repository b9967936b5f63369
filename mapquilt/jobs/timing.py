"""Comparable processor times: one thread, and nothing left to compile or load."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import cv2
import numba
import numpy as np

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.merger import match_maps
from merge.settings import MergeSettings


@contextmanager
def one_thread() -> Iterator[None]:
    """Run OpenCV and numba on one thread within the block."""
    before = cv2.getNumThreads(), numba.get_num_threads()
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before[0])
        numba.set_num_threads(before[1])


@cache
def warm_up(settings: MergeSettings) -> None:
    """Merge two small maps once a process, so that compilation does not count as the first pair's time."""
    walls = np.random.default_rng(0).random((12, 16)) < 0.3
    cells = np.pad(np.kron(np.where(walls, 1.0, -1.0), np.ones((12, 12))), 4)
    grid = OccupancyGrid(GridFrame(1.0, SE2.identity(), (cells.shape[0], cells.shape[1])), cells.astype(np.float32))
    match_maps(MapSet(("a", "b"), (grid, grid), ("cell", "cell")), settings)
