"""Counting grids of all particles, in tiles with copy on write.

A map is a table of tiles. Particles with a common ancestor share the tiles that neither has changed since; a particle
that writes to a shared tile gets a copy of its own first. Source: Grisetti, Stachniss and Burgard, "Improved techniques
for grid mapping with Rao-Blackwellized particle filters", T-RO 23 (2007), section VI; the tables are those of paged
memory.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import MAX_CELLS
from mapping.grid.traversal import HIT, SKIP, beam_ends, draw_scan, scan_extent
from mapping.robot.scan import LidarScan

TILE = 32
"""Side of a tile in cells, a power of two: 1.6 m at 5 cm. Smaller ones need longer tables, larger ones more copies."""

UNSEEN = -1
"""Entry of a table where no beam has passed."""

SUBCELLS = 65535.0
"""Steps of a mean within a cell, so that it fits in 16 bits."""

MARGIN = 4
"""Tables grow by at least this number of tiles."""

FARTHEST = 2**31
"""Largest distance from the origin [cells]: products of such numbers stay exact."""

COUNT_LIMIT = 65535
"""A cell stops counting at this number of visits, the largest of 16 bits: at 0.5 m an update, after 30 km there."""


class ParticleMap(NamedTuple):
    """The map of one particle, for compiled code: its table (rows, cols), and what ``TiledMaps`` holds for all."""

    table: NDArray[np.int32]
    visits: NDArray[np.uint16]
    hits: NDArray[np.uint16]
    means: NDArray[np.uint16]
    first: NDArray[np.int64]
    resolution: float


class TiledMaps:
    """Hold one map for each particle: the visits and hits of each cell, and the mean of the points that hit it.

    Cell [row, col] spans x in [col, col + 1) and y in [row, row + 1) times ``resolution`` [m]. A scan counts once in
    each cell that it touches; a hit wins over a pass.

    - ``table`` (N, rows, cols): tile of each particle at each place, or UNSEEN;
    - ``first`` (2,): row and col of the tables' first cell;
    - ``visits``, ``hits`` (T, TILE, TILE): number of scans that touched a cell, that ended in it;
    - ``means`` (T, TILE, TILE, 2): mean x and y of the points within their cell, in ``SUBCELLS``.
    """

    def __init__(self, particles: int, resolution: float) -> None:
        self.resolution = resolution
        self.table = np.full((particles, 0, 0), UNSEEN, np.int32)
        self.first = np.zeros(2, np.int64)
        self.visits = np.empty((0, TILE, TILE), np.uint16)
        self.hits = np.empty((0, TILE, TILE), np.uint16)
        self.means = np.empty((0, TILE, TILE, 2), np.uint16)
        self._owners = np.zeros(0, np.int32)
        self._scans = 0
        self._last_scan = np.zeros((0, 0), np.int32)
        self._hit = np.zeros((0, 0), np.float32)

    def integrate(self, particle: int, scan: LidarScan, map_from_lidar: SE2, clear_range: float) -> None:
        """Add a scan to the map of one particle; beams without a return clear the cells up to ``clear_range`` [m].

        Raises ``ValueError`` if the map would get more than 400 million cells, or the scan lies too far off.
        """
        ends, kinds = beam_ends(
            scan.ranges,
            scan.angle_min,
            scan.angle_increment,
            map_from_lidar.x,
            map_from_lidar.y,
            map_from_lidar.yaw,
            min(clear_range, scan.range_max),
            self.resolution,
        )
        if (kinds == SKIP).all():
            return
        start = np.array([map_from_lidar.x, map_from_lidar.y]) / self.resolution
        extent = scan_extent(start, ends)
        if not np.abs(extent).max() <= FARTHEST:
            raise ValueError(
                f"TiledMaps: a scan reaches {np.abs(extent).max() * self.resolution:g} m from the origin of the map; "
                "its pose or its ranges are wrong"
            )
        low, high = extent[:, ::-1].astype(np.int64) // TILE
        self._cover(low, high)
        shape = (high - low + 1) * TILE
        first = low * TILE
        start -= first[::-1]
        ends -= first[::-1]
        if (shape > self._hit.shape).any():
            self._hit = np.zeros(np.maximum(shape, self._hit.shape), np.float32)
            self._last_scan = np.zeros(self._hit.shape, np.int32)
        self._scans += 1
        one, none = np.float32(1.0), np.float32(0.0)
        draw_scan(
            self._hit,
            self._last_scan[:1, :1],  # visits, which _count counts
            self._last_scan,
            np.int32(self._scans),
            start[0],
            start[1],
            ends,
            kinds,
            one,
            -one,
            none,
            one,
            False,
        )
        rows, cols = ((first - self.first) // TILE).tolist()
        table = self.table[particle, rows : rows + shape[0] // TILE, cols : cols + shape[1] // TILE]
        free = self._free(table.size)
        _own(table, self._last_scan, self._scans, free, self._owners, self.visits, self.hits, self.means)
        _count(table, self._last_scan, self._scans, self._hit, self.visits, self.hits)
        _average(table, self.hits, self.means, ends, kinds)

    def resample(self, ancestors: NDArray[np.int64]) -> None:
        """Give each particle the map of its ancestor (N,); they share the tiles."""
        self.table = self.table[ancestors]
        held = self.table[self.table != UNSEEN]
        self._owners = np.bincount(held, minlength=self._owners.size).astype(np.int32)

    def map(self, particle: int) -> ParticleMap:
        """Return the map of one particle; it shares the memory."""
        return ParticleMap(self.table[particle], self.visits, self.hits, self.means, self.first, self.resolution)

    def counts(self, particle: int) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
        """Return hits and visits of one map as arrays (rows, cols), beginning at cell ``first``."""
        table = self.table[particle]
        hits = np.zeros((*table.shape, TILE, TILE), np.uint16)
        visits = np.zeros_like(hits)
        seen = table != UNSEEN
        hits[seen], visits[seen] = self.hits[table[seen]], self.visits[table[seen]]
        shape = (table.shape[0] * TILE, table.shape[1] * TILE)
        return hits.swapaxes(1, 2).reshape(shape), visits.swapaxes(1, 2).reshape(shape)

    def nbytes(self) -> int:
        """Return the memory of tables and tiles [bytes]."""
        arrays = (self.table, self.visits, self.hits, self.means, self._owners, self._hit, self._last_scan)
        return sum(array.nbytes for array in arrays)

    def _cover(self, low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
        """Make the tables cover tiles ``low`` to ``high`` (row, col), counted from the map's origin."""
        shape = np.array(self.table.shape[1:])
        first = self.first // TILE if shape.all() else low
        last = first + shape
        if (low >= first).all() and (high < last).all():
            return
        new_first = np.where(low < first, low - MARGIN, first)
        new_last = np.where(high >= last, high + 1 + MARGIN, last)
        rows, cols = ((new_last - new_first) * TILE).tolist()
        if rows * cols > MAX_CELLS:
            raise ValueError(f"TiledMaps: {rows} x {cols} cells of {self.resolution} m, must have at most {MAX_CELLS}")
        table = np.full((len(self.table), rows // TILE, cols // TILE), UNSEEN, np.int32)
        row, col = first - new_first
        table[:, row : row + shape[0], col : col + shape[1]] = self.table
        self.table, self.first = table, new_first * TILE

    def _free(self, needed: int) -> NDArray[np.int64]:
        """Return the indices of at least so many tiles that no particle holds."""
        free = np.flatnonzero(self._owners == 0)
        if free.size >= needed:
            return free
        held = self._owners.size
        size = held + max(needed, held // 4)
        self._owners = _extended(self._owners, size)
        self._owners[held:] = 0
        self.visits = _extended(self.visits, size)
        self.hits = _extended(self.hits, size)
        self.means = _extended(self.means, size)
        return np.flatnonzero(self._owners == 0)


def _extended(array: NDArray[Any], size: int) -> NDArray[Any]:
    longer = np.empty((size, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer


@njit(cache=True)
def _own(
    table: NDArray[np.int32],
    last_scan: NDArray[np.int32],
    scan: int,
    free: NDArray[np.int64],
    owners: NDArray[np.int32],
    visits: NDArray[np.uint16],
    hits: NDArray[np.uint16],
    means: NDArray[np.uint16],
) -> None:
    """Give the particle of a table a tile of its own wherever a scan touched a cell: an empty one, or a copy."""
    used = 0
    for row in range(table.shape[0]):
        for col in range(table.shape[1]):
            old = table[row, col]
            if old != UNSEEN and owners[old] == 1:
                continue
            if not (last_scan[row * TILE : (row + 1) * TILE, col * TILE : (col + 1) * TILE] == scan).any():
                continue
            new = free[used]
            used += 1
            if old == UNSEEN:
                visits[new], hits[new], means[new] = 0, 0, 0
            else:
                visits[new], hits[new], means[new] = visits[old], hits[old], means[old]
                owners[old] -= 1
            owners[new] = 1
            table[row, col] = new


@njit(cache=True)
def _count(
    table: NDArray[np.int32],
    last_scan: NDArray[np.int32],
    scan: int,
    hit: NDArray[np.float32],
    visits: NDArray[np.uint16],
    hits: NDArray[np.uint16],
) -> None:
    """Count a visit in each cell that a scan touched, and its hit."""
    for row in range(table.shape[0] * TILE):
        for col in range(table.shape[1] * TILE):
            if last_scan[row, col] == scan:
                tile, i, j = table[row // TILE, col // TILE], row % TILE, col % TILE
                if visits[tile, i, j] < COUNT_LIMIT:
                    visits[tile, i, j] += 1
                    hits[tile, i, j] += np.uint16(hit[row, col])


@njit(cache=True)
def _average(
    table: NDArray[np.int32],
    hits: NDArray[np.uint16],
    means: NDArray[np.uint16],
    ends: NDArray[np.float64],
    kinds: NDArray[np.int8],
) -> None:
    """Move the mean of each cell towards the points (B, 2) that hit it, x and y in cells of the table."""
    for k in range(ends.shape[0]):
        if kinds[k] != HIT:
            continue
        col, row = int(ends[k, 0]), int(ends[k, 1])
        tile, i, j = table[row // TILE, col // TILE], row % TILE, col % TILE
        mean, share = means[tile, i, j], 1.0 / max(hits[tile, i, j], 1)
        mean[0] = round(mean[0] + share * ((ends[k, 0] - col) * SUBCELLS - mean[0]))
        mean[1] = round(mean[1] + share * ((ends[k, 1] - row) * SUBCELLS - mean[1]))
