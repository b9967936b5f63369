"""Pictures of the steps of the correction, and of the answers of the two pipelines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapquilt.merging.morphology_steps import corrected_maps, refined_matches
from mapquilt.viz.match_picture import draw_matches
from mapquilt.viz.palette import INK, ROBOTS, WALL, picture
from mapquilt.viz.png import default_style
from merge.literature.chen2021.interest_points import point_picture
from merge.literature.chen2021.sift import Features, Sift
from merge.pair.feature_cache import prepare_map
from merge.preparation.map_image import pixels_from_cells, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.settings import PreparationSettings
from reproductions.chen2021.answers import Answer, acceptance_index
from reproductions.chen2021.cases import Case
from reproductions.chen2021.methods import CORRECTED, PLAIN, SCALE
from reproductions.chen2021.missions import MapPair

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110
PANEL_INCHES = 3.3
NEAR_CELLS = 5.0
"""Largest error of a match that counts as correct [cells of the coarser map]."""


STEPS = ("map", "walls (5.1)", "rotated, closed (5.2, 5.3)", "interest points (5.4)", "structure, corners (5.5)")


@default_style()
def steps_figure(case: Case, pair: MapPair, seed: int) -> Figure:
    """Draw both maps through the steps of the correction, a row for each map."""
    from matplotlib.figure import Figure

    corrected = corrected_maps((pair.first.grid, pair.second.grid))
    figure = Figure(figsize=(2.9 * len(STEPS), 5.9), dpi=DPI, layout="constrained")
    axes = figure.subplots(2, len(STEPS))
    for row, (each, name) in enumerate(zip(corrected, ("first map", "second map"), strict=True)):
        found = each.correction
        dots = cv2.dilate(point_picture(found.points, found.closed.shape), np.ones((3, 3), np.uint8)).astype(np.uint8)
        longest = max(found.structure.shape)
        pictures = (found.picture, found.walls, found.closed, visible(dots, longest), visible(found.structure, longest))
        details = (
            name,
            f"{np.count_nonzero(found.walls):,} pixels",
            f"by {-np.degrees(found.direction.angle):.1f} degrees; closing {found.closing} px",
            f"{len(found.points)} points, L = {found.half}",
            f"{len(found.corners)} corners",
        )
        for panel, image, title, text in zip(axes[row], pictures, STEPS, details, strict=True):
            panel.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
            _titled(panel, title if row == 0 else "", text)
        u, v = found.corners.T
        axes[row, -1].plot(u, v, "o", ms=4.5, mfc="none", mec=ROBOTS[4], mew=1.0)
    figure.suptitle(
        f"{case.name}: the correction, step by step; seed {seed}", fontsize=12, color=INK, fontweight="bold"
    )
    return figure


@default_style()
def matches_figure(case: Case, pair: MapPair, answers: Sequence[Answer], seed: int) -> Figure:
    """Draw matches before and after the correction, and the merged maps with their acceptance index."""
    from matplotlib.figure import Figure

    grids = [pair.first.grid, pair.second.grid]
    figure = Figure(figsize=(4.0 * PANEL_INCHES, 2.6 * PANEL_INCHES), dpi=DPI, layout="constrained")
    axes = figure.subplots(2, 2, width_ratios=(2.0, 1.0))
    _draw_before(axes[0, 0], grids, pair.truth)
    _draw_after(axes[1, 0], grids, pair.truth)
    for row, (method, title) in enumerate(((PLAIN, "chapter 4: SIFT"), (CORRECTED, "chapter 5: the correction"))):
        answer = next((one for one in answers if one.method == method), None)
        _draw_merged(axes[row, 1], grids, None if answer is None else answer.place)
        index = acceptance_index(pair, pair.truth)
        _titled(axes[row, 1], title, "did not run" if answer is None else _caption(answer, index))
    figure.suptitle(f"{case.name}: {case.differs}; seed {seed}", fontsize=12, color=INK, fontweight="bold")
    return figure


def _caption(answer: Answer, true_index: float | None) -> str:
    if answer.index is None or answer.displacement_cells is None or true_index is None:
        return "no answer" if answer.place is None else "wrong: the maps have no cell in common"
    error = f"{'right' if answer.right else 'wrong'}, error {answer.displacement_cells:.1f} cells"
    return f"{error}; AI {answer.index:.3f}, at the truth {true_index:.3f}"


def _draw_before(axes: Axes, grids: Sequence[OccupancyGrid], truth: Similarity2) -> None:
    method = Sift.as_published()
    prepared_maps = [prepare_map(grid) for grid in grids]
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
    structures = [each.correction.structure for each in corrected]
    longest = max(max(each.shape) for each in structures)
    shown = visible(structures[0], longest), visible(structures[1], longest)
    if not found:
        nothing = np.empty((0, 2))
        draw_matches(axes, shown, (nothing, nothing), np.empty(0, dtype=bool))
        _titled(axes, "after: corners of the corrected maps", "too few agree")
        return
    best = found[0].corners
    there, here = corrected[0].corners[best.target], corrected[1].corners[best.source]
    near = _near([prepare_map(grid) for grid in grids], grids, there, here, truth)
    points = corrected[0].correction.corners[best.target], corrected[1].correction.corners[best.source]
    draw_matches(axes, shown, points, near)
    text = f"{len(near)} agree, {int(near.sum())} of them near the truth (green)"
    _titled(axes, "after: corners of the corrected maps", text)


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
