"""Elastic fusion: the maps of a group bend until their walls fall together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment.elastic import bend_onto
from merge.fusion import finest, fuse
from merge.multimap.straightening import straighten
from merge.pair.feature_cache import FeatureCache, map_cells_from_prepared, metres_from_prepared
from merge.preparation.prepared_map import PreparedMap
from merge.records.bend import Bend
from merge.records.bent_map import BentMap, bent_grid
from merge.settings import MergeSettings
from merge.verification.wall_overlap import WallOverlap, measure_wall_overlap_by_tolerance

Points = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Sheet:
    """A map on its way into the group: ``group_from_map`` is its transform, in stated metres.

    ``straight`` is the bend that straightened it, in cells of the map, None if none did; ``grid`` is the map after
    that, ``prepared`` the same for matching.
    """

    original: OccupancyGrid
    straight: Bend | None
    grid: OccupancyGrid
    prepared: PreparedMap
    group_from_map: Similarity2

    @staticmethod
    def of(
        original: OccupancyGrid, group_from_map: Similarity2, settings: MergeSettings, cache: FeatureCache
    ) -> _Sheet:
        prepared = cache.prepared(original)
        bend = straighten(prepared, settings.multimap.elastic.straightening)
        if bend is None:
            return _Sheet(original, None, original, prepared, group_from_map)
        straight = _scaled(bend, map_cells_from_prepared(prepared))
        grid = bent_grid(original, straight)
        return _Sheet(original, straight, grid, cache.prepared(grid), group_from_map)

    @property
    def group_from_prepared(self) -> Similarity2:
        """Transform from cells of the prepared map to metres of the group."""
        return self.group_from_map @ metres_from_prepared(self.grid.frame, self.prepared)

    @property
    def group_from_cells(self) -> Similarity2:
        """Transform from cells of the map as given to metres of the group."""
        frame = self.original.frame
        return self.group_from_map @ Similarity2.from_se2(frame.origin, frame.resolution)

    def straightened(self, cells: Points) -> Points:
        """Straighten points (N, 2) of the map, in its cells."""
        return cells if self.straight is None else self.straight.apply(cells)

    def bent(self, points: Points, bend: Bend | None) -> Points:
        """Bend points (N, 2) in metres of the group by a ``bend`` in cells of the prepared map."""
        if bend is None:
            return points
        return self.group_from_prepared.apply(bend.apply(self.group_from_prepared.inverse().apply(points)))


def bend_group(
    maps: Sequence[tuple[Similarity2, OccupancyGrid]], settings: MergeSettings, cache: FeatureCache
) -> tuple[BentMap | None, ...]:
    """Bend the maps of a group, each given with its transform, onto one another; None for maps that stay as they are.

    Each map is straightened by its own walls, and then bent onto the fusion of those placed already, that which shares
    most walls with them first. No map is the truth, so the mean displacement of all is taken from each (as onto the
    mean of an atlas, Guimond et al. 2000): two maps meet half way.
    """
    sheets = [_Sheet.of(grid, place, settings, cache) for place, grid in maps]
    order = _order(sheets, settings)
    bends: list[Bend | None] = [None] * len(sheets)
    placed = [(sheets[order[0]].group_from_map, sheets[order[0]].grid.cropped())]
    for index in order[1:]:
        sheet = sheets[index]
        bend = bends[index] = _bend_onto_fusion(sheet, placed, settings, cache)
        grid = sheet.grid
        if bend is not None:
            grid = bent_grid(grid, _scaled(bend, map_cells_from_prepared(sheet.prepared)))
        placed.append((sheet.group_from_map, grid.cropped()))
    if all(bend is None for bend in bends):
        return tuple(None if sheet.straight is None else _bent_map(sheet, sheet.straight, cache) for sheet in sheets)
    whole = _half_way(sheets, bends, settings, cache)
    return tuple(_bent_map(sheet, bend, cache) for sheet, bend in zip(sheets, whole, strict=True))


def _order(sheets: Sequence[_Sheet], settings: MergeSettings) -> list[int]:
    """Start with the map that shares most walls with all; go on with that which shares most with those before it."""
    shared = np.zeros((len(sheets), len(sheets)))
    for a, one in enumerate(sheets):
        for b, other in enumerate(sheets[:a]):
            overlap = _overlaps(one, other.prepared, other.group_from_prepared, settings)[0]
            shared[a, b] = shared[b, a] = overlap.inlier_length
    order = [int(shared.sum(axis=1).argmax())]
    while len(order) < len(sheets):
        left = [k for k in range(len(sheets)) if k not in order]
        order.append(max(left, key=lambda k: float(shared[k, order].sum())))
    return order


def _overlaps(
    sheet: _Sheet,
    target: PreparedMap,
    group_from_target: Similarity2,
    settings: MergeSettings,
    bend: Bend | None = None,
) -> tuple[WallOverlap, ...]:
    target_from_source = group_from_target.inverse() @ sheet.group_from_prepared
    points, alignment = settings.alignment.hypotheses.final_points, settings.alignment
    return measure_wall_overlap_by_tolerance(
        target, sheet.prepared, target_from_source, points, alignment.overlap, bend
    )


def _bend_onto_fusion(
    sheet: _Sheet,
    placed: Sequence[tuple[Similarity2, OccupancyGrid]],
    settings: MergeSettings,
    cache: FeatureCache,
) -> Bend | None:
    """Bend a map onto the fusion of others; None if it shares too few walls with them, or gains too little."""
    first, grid = placed[0]
    frame = finest(grid.frame, [each.frame.resolution * place.scale / first.scale for place, each in placed])
    fused = fuse(frame, [(first.inverse() @ place, each) for place, each in placed], settings=settings.merged_grid)
    target = cache.prepared(fused)
    group_from_target = first @ metres_from_prepared(fused.frame, target)
    limits = settings.multimap.elastic
    rigid = _overlaps(sheet, target, group_from_target, settings)
    if rigid[0].inlier_length < limits.min_common_cells:
        return None
    target_from_source = group_from_target.inverse() @ sheet.group_from_prepared
    bend = bend_onto(target, sheet.prepared, target_from_source, settings.alignment.elastic)
    bent = _overlaps(sheet, target, group_from_target, settings, bend)
    gain = (bent[-1].inlier_ratio or 0.0) - (rigid[-1].inlier_ratio or 0.0)
    return bend if gain >= limits.min_gain else None


def _half_way(
    sheets: Sequence[_Sheet], bends: Sequence[Bend | None], settings: MergeSettings, cache: FeatureCache
) -> list[Bend]:
    """Take the mean displacement of all maps from each; return the whole bends, in cells of the maps as given.

    The group as a whole is not moved: the mean place and direction of all walls stay.
    """
    spacing = settings.multimap.elastic.node_share * min(
        bend.spacing * sheet.group_from_prepared.scale
        for sheet, bend in zip(sheets, bends, strict=True)
        if bend is not None
    )
    walls = [sheet.group_from_prepared.apply(sheet.prepared.points) for sheet in sheets]
    common = Bend.at_rest(np.concatenate(walls), spacing, beyond=1)
    places = common.places
    total = np.zeros_like(places)
    for sheet, bend in zip(sheets, bends, strict=True):
        if bend is not None:
            before = bend.remove(sheet.group_from_prepared.inverse().apply(places))
            total += places - sheet.group_from_prepared.apply(before)
    back = common.displaced(-total / len(sheets))
    after = [back.apply(sheet.bent(w, bend)) for sheet, w, bend in zip(sheets, walls, bends, strict=True)]
    still = fit_similarity(np.concatenate(walls), np.concatenate(after), ScaleRange.known()) or Similarity2.identity()
    found = []
    for sheet, bend in zip(sheets, bends, strict=True):
        place, prepared = sheet.group_from_cells, cache.prepared(sheet.original)
        cells = map_cells_from_prepared(prepared)
        control = Bend.at_rest(cells.apply(prepared.points), spacing / place.scale, beyond=1)
        nodes = control.places
        there = sheet.bent(place.apply(sheet.straightened(nodes)), bend)
        found.append(control.displaced(place.inverse().apply(still.apply(back.apply(there))) - nodes))
    return found


def _bent_map(sheet: _Sheet, bend: Bend, cache: FeatureCache) -> BentMap:
    prepared = cache.prepared(sheet.original)
    points = map_cells_from_prepared(prepared).apply(prepared.points)
    moved = bend.apply(points)
    whole = fit_similarity(moved, points, ScaleRange.known()) or Similarity2.identity()
    largest = float(np.hypot(*(moved - whole.apply(points)).T).max())
    return BentMap(bend, largest * sheet.original.frame.resolution, sheet.straight is not None)


def _scaled(bend: Bend, change: Similarity2) -> Bend:
    """Express a bend in other cells, which are not turned."""
    corner, nodes = change.apply(bend.corner[None])[0], bend.nodes * change.scale
    return Bend(frozen_array(corner, np.float64), bend.spacing * change.scale, frozen_array(nodes, np.float64))
