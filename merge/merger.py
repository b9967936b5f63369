"""The merge of a team of maps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.frame import GridFrame, pixel_matrix, similarity_from_pixels
from mapping.grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.resampling import resampled
from mapping.se2 import SE2
from mapping.seeds import Role, stream
from mapping.similarity2 import Similarity2
from merge.chart import Chart
from merge.consistency import one_frame
from merge.fusion import fuse
from merge.methods import PROPOSERS, PUBLISHED
from merge.pair import PairAnswer, Sheet, merge_pair
from merge.proposer import Proposer
from merge.published import Published
from merge.result import Alternative, MergeResult, PairResult
from merge.scale_range import ScaleRange
from merge.settings import MergeSettings

MARGIN_CELLS = 32
"""Unknown cells around a map's known part, so that features at its rim are found whatever raster it came in."""

MOST_CELLS = 2**21
"""Larger maps are compared in wider cells: what they cost is bounded, and 1,000 cells a side tell places apart."""

Progress = Callable[[int, int], None]
"""Called with the number of pairs done and the number of pairs."""


def merge_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),  # noqa: B008
    seed: int = 0,
    on_progress: Progress | None = None,
) -> MergeResult:
    """Find the transforms between the maps of a team, say which to believe, and join those maps in one grid.

    Every pair is proposed by ``settings.method``, then verified, refined and decided by what is common to all
    methods; accepted pairs are chained into the frame of one map and fused there. The same maps, settings and seed
    give the same result; a pair's answer depends neither on the other maps nor on which of the two comes first. Maps
    that do not match are no error: their pair is refused with a reason. Raises ``ValueError`` where the seed is
    negative.
    """
    return _joined(maps, match_maps(maps, settings, seed, on_progress))


def match_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),  # noqa: B008
    seed: int = 0,
    on_progress: Progress | None = None,
) -> tuple[PairResult, ...]:
    """The pairwise answers of :func:`merge_maps` alone: nothing is chained or fused."""
    scale = settings.scale if settings.scale is not None else ScaleRange.automatic(maps)
    methods = (PUBLISHED[settings.method],) if settings.as_published else PROPOSERS[settings.method]
    sheets = [_sheet(grid, methods) for grid in maps.grids]
    indices = list(combinations(range(len(maps)), 2))
    pairs = []
    for done, (target, source) in enumerate(indices, start=1):
        in_cells = scale.times(_cells_per_cell(maps, target, source) * _width(sheets[source]) / _width(sheets[target]))
        answer = _answer(sheets[target], sheets[source], in_cells, settings, seed)
        pairs.append(_pair_result(maps, target, source, answer, sheets))
        if on_progress is not None:
            on_progress(done, len(indices))
    return tuple(pairs)


def _sheet(grid: OccupancyGrid, methods: Sequence[Proposer[Any] | Published[Any]]) -> Sheet:
    in_cells = OccupancyGrid(GridFrame(1.0, SE2.identity(), grid.frame.shape), grid.log_odds).cropped()
    chart = Chart(_lighter(in_cells).cropped(MARGIN_CELLS))
    return Sheet(chart, tuple(method.describe(chart) for method in methods))


def _lighter(grid: OccupancyGrid) -> OccupancyGrid:
    """The grid itself, or where it has more than ``MOST_CELLS`` cells, in cells so many times as wide."""
    times = math.ceil(math.sqrt(math.prod(grid.frame.shape) / MOST_CELLS))
    if times == 1:
        return grid
    rows, cols = (math.ceil(side / times) for side in grid.frame.shape)
    frame = GridFrame(float(times), grid.frame.origin, (rows, cols))
    return OccupancyGrid(frame, resampled(grid, Similarity2.identity(), frame))


def _width(sheet: Sheet) -> float:
    """Of a cell of the sheet, in cells of its map."""
    return sheet.chart.grid.frame.resolution


def _cells_per_cell(maps: MapSet, target: int, source: int) -> float:
    if "cell" in (maps.units[target], maps.units[source]):
        return 1.0
    return maps.grids[source].frame.resolution / maps.grids[target].frame.resolution


def _answer(target: Sheet, source: Sheet, scale: ScaleRange, settings: MergeSettings, seed: int) -> PairAnswer:
    rng = stream(seed, Role.MERGE)
    if _order(target.chart.grid) <= _order(source.chart.grid):
        return _judged(target, source, scale, settings, rng)
    return _judged(source, target, scale.inverse(), settings, rng).inverse()


def _judged(
    target: Sheet, source: Sheet, scale: ScaleRange, settings: MergeSettings, rng: np.random.Generator
) -> PairAnswer:
    if settings.as_published:
        return PUBLISHED[settings.method].published(target.descriptions[0], source.descriptions[0], scale, rng)
    return merge_pair(target, source, scale, PROPOSERS[settings.method], rng, settings.decision)


def _order(grid: OccupancyGrid) -> tuple[tuple[int, int], bytes]:
    return grid.frame.shape, grid.log_odds.tobytes()


def _pair_result(maps: MapSet, target: int, source: int, answer: PairAnswer, sheets: Sequence[Sheet]) -> PairResult:
    frames = maps.grids[target].frame, maps.grids[source].frame

    def in_pixels(cells: Similarity2) -> NDArray[np.float64]:
        return _pixels(sheets[target], cells, sheets[source], frames)

    def in_metres(cells: Similarity2) -> Similarity2:
        return similarity_from_pixels(frames[0], in_pixels(cells), frames[1])

    found, metric, covariance = answer.target_from_source, None, None
    if found is not None:
        metric = in_metres(found)
        if answer.uncertainty is not None:
            covariance = answer.uncertainty.of_parameters(_metres_from_cells(frames[0], sheets[target]), metric)
    return PairResult(
        target=maps.names[target],
        source=maps.names[source],
        accepted=answer.decision.accepted,
        confidence=answer.decision.confidence,
        reason=answer.decision.reason,
        target_from_source=metric,
        target_from_source_pixels=None if found is None else in_pixels(found),
        unit=maps.units[target],
        evidence=answer.evidence,
        covariance=covariance,
        alternatives=tuple(
            Alternative(in_metres(other.target_from_source), other.agreement) for other in answer.alternatives
        ),
    )


def _metres_from_cells(frame: GridFrame, sheet: Sheet) -> Similarity2:
    corner = Similarity2.from_se2(sheet.chart.grid.frame.origin, _width(sheet))
    return Similarity2.from_se2(frame.origin, frame.resolution) @ corner


def _pixels(
    target: Sheet, cells: Similarity2, source: Sheet, frames: tuple[GridFrame, GridFrame]
) -> NDArray[np.float64]:
    corners = [Similarity2.from_se2(sheet.chart.grid.frame.origin, _width(sheet)) for sheet in (target, source)]
    bare = [GridFrame(1.0, SE2.identity(), frame.shape) for frame in frames]
    return pixel_matrix(bare[0], corners[0] @ cells @ corners[1].inverse(), bare[1])


def _joined(maps: MapSet, pairs: tuple[PairResult, ...]) -> MergeResult:
    grid_of = dict(zip(maps.names, maps.grids, strict=True))
    frames = one_frame({name: int(np.count_nonzero(grid.known)) for name, grid in grid_of.items()}, pairs)
    placed = [(transform, grid_of[name].cropped()) for name, transform in frames.reference_from_map.items()]
    return MergeResult(
        names=maps.names,
        pairs=pairs,
        reference=frames.reference,
        reference_from_map=frames.reference_from_map,
        left_out=frames.left_out,
        merged=fuse(grid_of[frames.reference].cropped().frame, placed),
    )
