"""Pictures of the maps of a seed, and of the answers of the two pipelines to each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapquilt.merging.morphology_steps import corrected_maps, refined_matches
from mapquilt.viz.match_picture import draw_matches
from mapquilt.viz.palette import INK, ROBOTS, WALL, picture
from mapquilt.viz.png import default_style
from merge.literature.chen2021.morphology import CorrectedMap
from merge.literature.chen2021.sift import Features, Sift
from merge.preparation.map_image import pixels_from_cells, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.settings import PreparationSettings
from reproductions.chen2021.answers import CaseAnswer
from reproductions.chen2021.cases import Case, Place
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import CORRECTED, PLAIN, SCALE
from reproductions.chen2021.missions import DrawnMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110
PANEL_INCHES = 3.3
NEAR_CELLS = 5.0
"""Largest error of a match that counts as correct [cells of the coarser map]."""


@default_style()
def maps_figure(place: Place, maps: Mapping[str, DrawnMap]) -> Figure:
    """Draw every map, with the corrected one below it."""
    from matplotlib.figure import Figure

    corrected = corrected_maps([drawn.grid for drawn in maps.values()])
    figure = Figure(figsize=(2.6 * len(maps), 5.6), dpi=DPI, layout="constrained")
    axes = figure.subplots(2, len(maps), squeeze=False)
    for column, (name, drawn, found) in enumerate(zip(maps, maps.values(), corrected, strict=True)):
        axes[0, column].imshow(picture(drawn.grid), origin="lower", interpolation="antialiased")
        rows, cols = drawn.grid.frame.shape
        _titled(axes[0, column], name, f"{cols} x {rows} cells of {drawn.grid.frame.resolution:g} m")
        structure = found.correction.structure
        axes[1, column].imshow(visible(structure, max(structure.shape)), cmap="gray", interpolation="antialiased")
        text = f"L = {found.correction.half}, {len(found.corners)} corners"
        _titled(axes[1, column], "corrected", text)
    figure.suptitle(f"The {place}: maps of one seed, and the corrected maps", fontsize=11, color=INK)
    return figure


@default_style()
def case_figure(case: Case, maps: Mapping[str, DrawnMap], study: Study, seed: int) -> Figure:
    """Draw matches before and after the correction, and the merged maps with their acceptance index."""
    from matplotlib.figure import Figure

    grids = [maps[name].grid for name in case.maps]
    truth = Similarity2.from_se2(maps[case.maps[0]].world_from_map.inverse() @ maps[case.maps[1]].world_from_map)
    figure = Figure(figsize=(4.0 * PANEL_INCHES, 2.6 * PANEL_INCHES), dpi=DPI, layout="constrained")
    axes = figure.subplots(2, 2, width_ratios=(2.0, 1.0))
    _draw_before(axes[0, 0], grids, truth)
    _draw_after(axes[1, 0], grids, truth)
    for row, method in enumerate((PLAIN, CORRECTED)):
        answer = _answer(study, case, method, seed)
        place = None if answer is None else answer.pair.answer
        _draw_merged(axes[row, 1], grids, place)
        _titled(axes[row, 1], method, _caption(answer))
    figure.suptitle(f"{case.title}; seed {seed}", fontsize=12, color=INK, fontweight="bold")
    return figure


def _answer(study: Study, case: Case, method: str, seed: int) -> CaseAnswer | None:
    found = [a for a in study.answers if (a.case, a.pair.method, a.seed) == (case.name, method, seed)]
    return found[0] if found else None


def _caption(answer: CaseAnswer | None) -> str:
    if answer is None:
        return "did not run"
    error = answer.pair.error
    if answer.index is None or answer.true_index is None or error is None or error.displacement_cells is None:
        return "no answer" if answer.pair.answer is None else "wrong: the maps have no cell in common"
    outcome = "right" if answer.pair.right else "wrong"
    indices = f"AI {answer.index:.3f}, at the truth {answer.true_index:.3f}"
    return f"{outcome}, error {error.displacement_cells:.1f} cells; {indices}"


def _draw_before(axes: Axes, grids: Sequence[OccupancyGrid], truth: Similarity2) -> None:
    method = Sift.as_published()
    prepared_maps = [_prepared(grid) for grid in grids]
    features: list[Features] = [method.describe(prepared) for prepared in prepared_maps]
    there, here = method.matched(features[0], features[1])
    near = _near(prepared_maps, grids, there, here, truth)
    pictures = trinary_picture(prepared_maps[0].grid), trinary_picture(prepared_maps[1].grid)
    draw_matches(axes, pictures, (_pixels(prepared_maps[0], there), _pixels(prepared_maps[1], here)), near)
    _titled(axes, "before: SIFT on the maps", f"{len(near)} matches, {int(near.sum())} of them near the truth (green)")


def _draw_after(axes: Axes, grids: Sequence[OccupancyGrid], truth: Similarity2) -> None:
    corrected = corrected_maps(grids)
    ratio = grids[1].frame.resolution / grids[0].frame.resolution
    found = refined_matches(corrected[0], corrected[1], SCALE.times(ratio))
    there, here = (each.correction.structure for each in corrected)
    longest = max(*there.shape, *here.shape)
    structures = visible(there, longest), visible(here, longest)
    if not found:
        nothing = np.empty((0, 2))
        draw_matches(axes, structures, (nothing, nothing), np.empty(0, dtype=bool))
        _titled(axes, "after: corners of the corrected maps", "too few agree")
        return
    best = found[0].corners
    near = _near([_prepared(grid) for grid in grids], grids, *_corners(corrected, best.target, best.source), truth)
    points = corrected[0].correction.corners[best.target], corrected[1].correction.corners[best.source]
    draw_matches(axes, structures, points, near)
    before, after = (("-" if index is None else f"{index:.3f}") for index in (found[0].index_before, found[0].index))
    text = f"{len(near)} agree, {int(near.sum())} of them near the truth; AI {before}, after ICP {after}"
    _titled(axes, "after: corners of the corrected maps", text)


def _corners(
    corrected: Sequence[CorrectedMap], target: NDArray[np.intp], source: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return corrected[0].corners[target], corrected[1].corners[source]


def _prepared(grid: OccupancyGrid) -> PreparedMap:
    cropped = grid.cropped(PreparationSettings.border_cells)
    return PreparedMap(OccupancyGrid(GridFrame(1.0, SE2.identity(), cropped.frame.shape), cropped.log_odds))


def _pixels(prepared: PreparedMap, cells: NDArray[np.float64]) -> NDArray[np.float64]:
    return pixels_from_cells(cells, prepared.grid.frame.shape[0])


def _near(
    prepared_maps: Sequence[PreparedMap],
    grids: Sequence[OccupancyGrid],
    there: NDArray[np.float64],
    here: NDArray[np.float64],
    truth: Similarity2,
) -> NDArray[np.bool_]:
    """Mark the matches (M,) whose cells (M, 2) of the prepared maps coincide under the truth."""
    target, source = (grid.cropped(PreparationSettings.border_cells).frame for grid in grids)
    metres = [
        Similarity2.from_se2(frame.origin, frame.resolution).apply(cells)
        for frame, cells in ((target, there), (source, here))
    ]
    allowed = NEAR_CELLS * max(target.resolution, source.resolution)
    return np.asarray(np.hypot(*(truth.apply(metres[1]) - metres[0]).T) < allowed)


def _draw_merged(axes: Axes, grids: Sequence[OccupancyGrid], place: Similarity2 | None) -> None:
    target, source = grids
    shown = None if place is None or not 0.02 < place.scale < 50.0 else place
    frame = _around(target, source, shown)
    axes.set_facecolor("#d6d9dd")
    base = OccupancyGrid(frame, resampled(target, Similarity2.identity(), frame, 2))
    image = picture(base, _rgb(ROBOTS[0]))
    if shown is not None:
        other = OccupancyGrid(frame, resampled(source, shown, frame, 2))
        image[other.free & ~base.occupied] = 255
        image[other.occupied] = _rgb(ROBOTS[1])
        image[base.occupied] = _rgb(ROBOTS[0])
        image[base.occupied & other.occupied] = WALL
    axes.imshow(image, origin="lower", interpolation="antialiased")


def _around(target: OccupancyGrid, source: OccupancyGrid, place: Similarity2 | None) -> GridFrame:
    """Return a frame around the known cells of both maps with a margin, limited around the target if the source is far
    away or much too large."""
    frame = target.cropped().frame
    low, high = np.zeros(2), np.array(frame.shape, dtype=float)
    beyond = 1.5 * max(frame.shape)
    if place is not None:
        cells = np.argwhere(source.known)[::7]
        there = frame.cells_from_metres(place.apply(source.frame.metres_from_cells(cells)))
        low = np.maximum(np.minimum(low, there.min(axis=0)), -beyond)
        high = np.minimum(np.maximum(high, there.max(axis=0)), high + beyond)
    margin = round(0.06 * float((high - low).max()))
    first, last = np.floor(low).astype(int) - margin, np.ceil(high).astype(int) + margin
    rows, cols = (last - first).tolist()
    return frame.window((int(first[0]), int(first[1])), (rows, cols))


def visible(structure: NDArray[np.uint8], longest: int) -> NDArray[np.uint8]:
    """Thicken lines of one pixel, so that they stay visible in a picture that is shown at reduced size."""
    width = 2 * (longest // 500) + 1
    return cv2.dilate(structure, np.ones((width, width), np.uint8)).astype(np.uint8)


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _titled(axes: Axes, name: str, details: str) -> None:
    axes.set_title(f"{name}\n", loc="left", fontsize=10, fontweight="bold", color=INK)
    axes.text(0.0, 1.015, details, transform=axes.transAxes, fontsize=8, color=INK)
    axes.set(xticks=[], yticks=[], anchor="NW")
    for spine in axes.spines.values():
        spine.set_color("#d0d4d9")
