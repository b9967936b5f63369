"""Conversion between grey levels and occupancy by the rules of nav2's map_server."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from mapping.grid.occupancy_grid import FREE, OCCUPIED, TRINARY_LOG_ODDS, UNKNOWN, OccupancyGrid
from mapping.io.map_yaml import MapYaml, Mode
from mapping.io.picture import Picture

OCCUPIED_GREY, FREE_GREY, UNKNOWN_GREY = 0, 254, 205
"""Grey levels that map_server's saver writes in trinary mode."""

_RAW_UNKNOWN_GREY = 255
_CERTAIN = 0.0025  # 0 % and 100 % have no log-odds: they count as 0.25 % and 99.75 %, which round to themselves
_UNDECIDED = -0.01  # 50 % has log-odds 0, which would say unknown: a seen cell stays known, on the side of free


def cell_of_grey(meta: MapYaml) -> NDArray[np.int8]:
    """Return the cell value (256,) of each grey level: 0 to 100, or -1 unknown.

    Source: ``loadMapFromFile`` of nav2_map_server (map_io.cpp since nav2's pull request 5071), which computes with
    8-bit grey in single precision.
    """
    grey = np.arange(256)
    if meta.mode == "raw":
        return np.where(grey <= OCCUPIED, grey, UNKNOWN).astype(np.int8)
    shade = grey.astype(np.float32) / np.float32(255.0)
    p = shade if meta.negate else np.float32(1.0) - shade
    occupied, free = np.float32(meta.occupied_thresh), np.float32(meta.free_thresh)
    cells = np.full(256, UNKNOWN, dtype=np.int8)
    cells[p >= occupied] = OCCUPIED
    cells[p <= free] = FREE
    if meta.mode == "scale":
        between = (p > free) & (p < occupied)
        with np.errstate(over="ignore"):
            span = np.float32(meta.occupied_thresh - meta.free_thresh)
        cells[between] = _round_half_up((p[between] - free) / span * np.float32(100.0))
    return cells


def _round_half_up(values: NDArray[np.float32]) -> NDArray[np.int8]:
    # As C's round does for positive numbers; numpy's rounds halves to even.
    whole = np.floor(values)
    return (whole + (values - whole >= np.float32(0.5))).astype(np.int8)


def log_odds_of_cell(mode: Mode) -> NDArray[np.float32]:
    """Return the log-odds (102,) float32 of cell values -1, 0, ..., 100, in that order.

    A trinary cell has those of ``OccupancyGrid.from_occupancy``; in the other modes v per cent has log(p / (1 - p)),
    which ``percent`` inverts. Only -1 is unknown: 50 % is just free.
    """
    if mode == "trinary":
        table = np.zeros(102)
        table[1 + FREE], table[1 + OCCUPIED] = -TRINARY_LOG_ODDS, TRINARY_LOG_ODDS
        return table.astype(np.float32)
    p = np.clip(np.arange(101) / 100.0, _CERTAIN, 1.0 - _CERTAIN)
    known = np.log(p) - np.log1p(-p)
    known[50] = _UNDECIDED
    return np.concatenate(([0.0], known)).astype(np.float32)


def percent(grid: OccupancyGrid) -> NDArray[np.int8]:
    """Return the occupancy in per cent (rows, cols) int8, row 0 lowest, -1 unknown: above 50 only if occupied."""
    values = np.rint(100.0 * expit(grid.log_odds)).astype(np.int8)
    values = np.where(grid.occupied, np.maximum(values, 51), np.minimum(values, 50))
    return np.where(grid.known, values, UNKNOWN).astype(np.int8)


def picture_of_grid(grid: OccupancyGrid, mode: Mode) -> Picture:
    """Draw the picture (H, W), top row first, that map_server's saver writes for a grid.

    ``trinary`` stores exactly ``occupancy()``; ``scale`` and ``raw`` store ``percent``. Unknown is grey 205 in
    trinary mode, transparent in scale mode, 255 in raw mode.
    """
    if mode == "trinary":
        grey = np.full(grid.frame.shape, UNKNOWN_GREY, dtype=np.uint8)
        grey[grid.occupied] = OCCUPIED_GREY
        grey[grid.free] = FREE_GREY
        return Picture(grey[::-1])
    cells = percent(grid)[::-1]
    known = cells != UNKNOWN
    if mode == "raw":
        return Picture(np.where(known, cells, _RAW_UNKNOWN_GREY).astype(np.uint8))
    brightness = np.rint(255.0 * (1.0 - cells / 100.0))
    return Picture(np.where(known, brightness, 127).astype(np.uint8), known)


def thresholds(mode: Mode) -> tuple[float, float]:
    """Return (occupied_thresh, free_thresh) with which a loader reads back the picture of ``picture_of_grid``.

    In scale mode everything between the thresholds is stretched to 0..100, so only 1 and 0 change nothing.
    """
    return (1.0, 0.0) if mode == "scale" else (0.65, 0.196)
