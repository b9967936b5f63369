"""Cache of prepared maps and their features."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from mapping.arrays import sealed
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from merge.methods import Proposer, Published
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.settings import PreparationSettings

Method = Proposer[Any] | Published[Any]


class Describer(Protocol):
    """A step that describes each map once."""

    def describe(self, prepared: PreparedMap) -> Any:
        """Compute all that the step needs of one map."""
        ...


@dataclass(frozen=True, eq=False)
class MapFeatures:
    """A prepared map, and what each proposer of the method found on it.

    ``known`` holds the descriptions so far, those of later steps too.
    """

    prepared: PreparedMap
    descriptions: tuple[Any, ...]
    known: dict[Describer, Any] = field(default_factory=dict)

    def describe(self, step: Describer) -> Any:
        """Return the description of the map by a step, made when it is first asked for."""
        if step not in self.known:
            self.known[step] = step.describe(self.prepared)
        return self.known[step]


class FeatureCache:
    """Prepared maps and their features, of the maps that were used last."""

    def __init__(self, settings: PreparationSettings = PreparationSettings(), kept: int | None = None) -> None:
        self._settings, self._kept = settings, kept or settings.cached_maps
        self._maps: OrderedDict[bytes, MapFeatures] = OrderedDict()

    def prepared(self, grid: OccupancyGrid) -> PreparedMap:
        """Return the prepared map of a grid."""
        return self._known(grid).prepared

    def features(self, grid: OccupancyGrid, methods: Sequence[Method]) -> MapFeatures:
        """Return the features of a grid for these methods."""
        known = self._known(grid)
        return dataclasses.replace(known, descriptions=tuple(known.describe(method) for method in methods))

    def clear(self) -> None:
        """Forget all maps."""
        self._maps.clear()

    def keep(self, grids: Iterable[OccupancyGrid]) -> None:
        """Forget all maps but these."""
        kept = set(map(fingerprint, grids))
        self._maps = OrderedDict((key, features) for key, features in self._maps.items() if key in kept)

    def _known(self, grid: OccupancyGrid) -> MapFeatures:
        key = fingerprint(grid)
        if key not in self._maps:
            self._maps[key] = MapFeatures(prepare_map(grid, self._settings), ())
        self._maps.move_to_end(key)
        if len(self._maps) > self._kept:
            self._maps.popitem(last=False)
        return self._maps[key]


def fingerprint(grid: OccupancyGrid) -> bytes:
    """Hash the cells of a map, whatever its frame: 32 bytes."""
    digest = hashlib.sha256(repr(grid.frame.shape).encode())
    digest.update(np.ascontiguousarray(grid.log_odds).data)
    return digest.digest()


def prepare_map(grid: OccupancyGrid, settings: PreparationSettings = PreparationSettings()) -> PreparedMap:
    """Prepare the known part of a map, in its own cells or, for a large map, in wider ones."""
    in_cells = OccupancyGrid(GridFrame(1.0, SE2.identity(), grid.frame.shape), grid.log_odds).cropped()
    return PreparedMap(_limit_size(in_cells, settings.max_cells).cropped(settings.border_cells), settings)


def cell_width(prepared: PreparedMap) -> float:
    """Return the width of a cell of a prepared map, in cells of the map that it was prepared from."""
    return prepared.grid.frame.resolution


def map_cells_from_prepared(prepared: PreparedMap) -> Similarity2:
    """Return the transform from cells of the prepared map to cells of the original one."""
    return Similarity2.from_se2(prepared.grid.frame.origin, cell_width(prepared))


def metres_from_prepared(frame: GridFrame, prepared: PreparedMap) -> Similarity2:
    """Return the transform from cells of the prepared map to metres of the original one, which has that frame."""
    return Similarity2.from_se2(frame.origin, frame.resolution) @ map_cells_from_prepared(prepared)


def _limit_size(grid: OccupancyGrid, max_cells: int) -> OccupancyGrid:
    """Resample a grid of more than ``max_cells`` cells to cells a whole number of times as wide."""
    times = math.ceil(math.sqrt(math.prod(grid.frame.shape) / max_cells))
    if times == 1:
        return grid
    rows, cols = (math.ceil(side / times) for side in grid.frame.shape)
    frame = GridFrame(float(times), grid.frame.origin, (rows, cols))
    return OccupancyGrid(frame, sealed(resampled(grid, Similarity2.identity(), frame)))
