"""Maps made ready for comparison, each once, and no more of them kept than memory should hold."""

from __future__ import annotations

import hashlib
import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from merge.literature.published import Published
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.proposer import Proposer

MARGIN_CELLS = 32
"""Unknown cells around a map's known part, so that features at its rim are found whatever raster it came in."""

MOST_CELLS = 2**21
"""Larger maps are compared in wider cells: what they cost is bounded, and 1,000 cells a side tell places apart."""

KEPT = 40
"""Maps that a shelf holds: what is known of one of 400 x 400 cells takes about 8 MB."""

Method = Proposer[Any] | Published[Any]


@dataclass(frozen=True, eq=False)
class MapFeatures:
    """A map as the merger holds it: its chart, and what each proposer of the method found on it."""

    chart: PreparedMap
    descriptions: tuple[Any, ...]


class FeatureCache:
    """What is known of the maps that were last asked for."""

    def __init__(self, kept: int = KEPT) -> None:
        self._kept = kept
        self._maps: OrderedDict[bytes, tuple[PreparedMap, dict[Method, Any]]] = OrderedDict()

    def chart(self, grid: OccupancyGrid) -> PreparedMap:
        """The chart of a map, made where it is not at hand."""
        return self._known(grid)[0]

    def sheet(self, grid: OccupancyGrid, methods: Sequence[Method]) -> MapFeatures:
        """The sheet of a map for these methods, made where it is not at hand."""
        chart, descriptions = self._known(grid)
        for method in methods:
            if method not in descriptions:
                descriptions[method] = method.describe(chart)
        return MapFeatures(chart, tuple(descriptions[method] for method in methods))

    def _known(self, grid: OccupancyGrid) -> tuple[PreparedMap, dict[Method, Any]]:
        key = fingerprint(grid)
        if key not in self._maps:
            self._maps[key] = prepare_map(grid), {}
        self._maps.move_to_end(key)
        if len(self._maps) > self._kept:
            self._maps.popitem(last=False)
        return self._maps[key]


def fingerprint(grid: OccupancyGrid) -> bytes:
    """32 bytes that tell the cells of a map, wherever they lie."""
    return hashlib.sha256(repr(grid.frame.shape).encode() + grid.log_odds.tobytes()).digest()


def prepare_map(grid: OccupancyGrid) -> PreparedMap:
    """The chart of a map's known part, in its own cells or, of a large map, in wider ones."""
    in_cells = OccupancyGrid(GridFrame(1.0, SE2.identity(), grid.frame.shape), grid.log_odds).cropped()
    return PreparedMap(_lighter(in_cells).cropped(MARGIN_CELLS))


def cell_width(chart: PreparedMap) -> float:
    """Of a cell of the chart, in cells of its map."""
    return chart.grid.frame.resolution


def map_cells_from_prepared(chart: PreparedMap) -> Similarity2:
    """From cells of the chart to cells of the map that it is of."""
    return Similarity2.from_se2(chart.grid.frame.origin, cell_width(chart))


def metres_from_prepared(frame: GridFrame, chart: PreparedMap) -> Similarity2:
    """From cells of the chart of a map with that frame to its metres."""
    return Similarity2.from_se2(frame.origin, frame.resolution) @ map_cells_from_prepared(chart)


def _lighter(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid itself, or where it has more than ``MOST_CELLS`` cells, in cells so many times as wide."""
    times = math.ceil(math.sqrt(math.prod(grid.frame.shape) / MOST_CELLS))
    if times == 1:
        return grid
    rows, cols = (math.ceil(side / times) for side in grid.frame.shape)
    frame = GridFrame(float(times), grid.frame.origin, (rows, cols))
    return OccupancyGrid(frame, resampled(grid, Similarity2.identity(), frame))
