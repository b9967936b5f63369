"""Pictures of a run: the maps and their merge, and the whole against the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as Outline
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.evaluation.map_quality import align_to_world
from mapquilt.evaluation.run_score import RunScore
from mapquilt.merging.merge_file import GroupRecord
from mapquilt.runs.truth_file import RunTruth
from mapquilt.viz.palette import FENCE, FREE, TRUE_WALL, UNKNOWN, map_colours, of_255, picture, robot_colour
from mapquilt.viz.panels import Extent, lay_out, write_title
from merge.records.result import MergedGroup
from sim.mission.mission import Mission

LEGEND_COLUMNS, LEGEND_ROW_INCHES = 5, 0.17
OPACITY = 0.9
"""Opacity of a map's walls where they cover those of other maps."""


def merge_figure(maps: MapSet, groups: Sequence[MergedGroup]) -> Figure:
    """Draw the merged map of each group, with walls in the colours of their maps, and every input map. A group of one
    map is only drawn if it is the first."""
    shown = [group for index, group in enumerate(groups) if index == 0 or len(group.reference_from_map) > 1]
    figure, panels = lay_out([_extent(grid) for grid in (*(group.merged for group in shown), *maps.grids)])
    for panel, group in zip(panels, shown, strict=False):
        # The maps' own walls cover the merged ones, which would darken their colours.
        _show_grid(panel, group.merged, walls=not group.reference_from_map)
        _show_all_walls(panel, maps, group.reference_from_map)
        conflicts = int(np.count_nonzero(group.conflicts.occupied))
        details = f", {conflicts} cells in conflict" if conflicts else ""
        title = "merged map" if len(shown) == 1 else f"merged map {shown.index(group) + 1}"
        write_title(panel, title, f"{_count(group.reference_from_map, maps)}, frame of {group.reference}{details}")
    number_of = {name: number for number, group in enumerate(shown, 1) for name in group.reference_from_map}
    colours = map_colours(maps.names)
    for panel, name, grid, colour in zip(panels[len(shown) :], maps.names, maps.grids, colours, strict=True):
        _show_grid(panel, grid)
        joined = "" if len(shown) == 1 else f"in merged map {number_of.get(name)}"
        write_title(panel, name, joined if name in number_of else "not merged", colour)
    return figure


def _count(placed: Mapping[str, Similarity2], maps: MapSet) -> str:
    return f"{len(placed)} of {len(maps)} maps"


def overview_figure(
    mission: Mission,
    maps: MapSet,
    truth: RunTruth,
    groups: Sequence[tuple[GroupRecord, OccupancyGrid]],
    score: RunScore,
) -> Figure:
    """Draw the world with the paths, the merged grid of each group, the merged walls over the truth, and each map."""
    width, height = mission.world.size
    world = Extent(0.0, width, 0.0, height)
    legend = LEGEND_ROW_INCHES * math.ceil(len(mission.robots) / LEGEND_COLUMNS)
    extents = [_extent(merged) for _, merged in groups]
    figure, panels = lay_out([world, *extents, world, *map(_extent, maps.grids)], legend)
    _show_world(panels[0], mission)
    for number, (panel, (group, merged)) in enumerate(zip(panels[1:], groups, strict=False)):
        _show_grid(panel, merged)
        title = "merged map" if len(groups) == 1 else f"merged map {number + 1}"
        details = _quality(score, group)
        write_title(panel, title, f"{_count(group.reference_from_map, maps)}, frame of {group.reference}{details}")
    _show_over_truth(panels[1 + len(groups)], mission, maps, truth, [group for group, _ in groups])
    colours = map_colours(maps.names)
    for panel, name, grid, colour in zip(panels[2 + len(groups) :], maps.names, maps.grids, colours, strict=True):
        _show_grid(panel, grid)
        scale, resolution = truth.robot(name).truth.world_from_map.scale, grid.frame.resolution
        write_title(panel, name, f"states {resolution:g} m a cell, truly {resolution * scale:.3f} m", colour)
    return figure


def _quality(score: RunScore, group: GroupRecord) -> str:
    found = next((each.quality for each in score.merged if each.reference == group.reference), None)
    return "" if found is None else f"; free IoU {found.iou_free:.2f}, walls F1 {found.f1_walls:.2f}"


def _extent(grid: OccupancyGrid) -> Extent:
    """Return the extent of a map's known cells, in its own metres."""
    frame, known = grid.frame, grid.known
    if not known.any():
        known = np.ones(frame.shape, bool)
    rows, last = np.flatnonzero(known.any(axis=1)), frame.shape[1] - 1
    ends = known[rows].argmax(axis=1), last - known[rows, ::-1].argmax(axis=1)  # the outermost known cells of each row
    metres = frame.metres_from_cells(np.concatenate([np.column_stack((rows, end)) for end in ends]))
    (left, low), (right, high) = metres.min(axis=0), metres.max(axis=0)
    return Extent(left - frame.resolution, right + frame.resolution, low - frame.resolution, high + frame.resolution)


def _show_grid(panel: Axes, grid: OccupancyGrid, walls: bool = True) -> None:
    panel.set_facecolor(of_255(UNKNOWN))
    image = picture(grid) if walls else picture(grid, wall=FREE)
    _show_image(panel, image, grid.frame, Similarity2())


def _show_image(
    panel: Axes, image: NDArray[np.uint8], frame: GridFrame, panel_from_map: Similarity2, zorder: float = 0.0
) -> None:
    """Draw a picture of a map, row 0 lowest, at its origin and transform."""
    placed = Affine2D(np.vstack((panel_from_map.matrix(), (0.0, 0.0, 1.0))))
    drawn = panel.imshow(image[::-1], origin="upper", interpolation="antialiased", aspect="auto", zorder=zorder)
    drawn.set_transform(Affine2D(frame.metre_from_pixel()) + placed + panel.transData)


def _show_all_walls(panel: Axes, maps: MapSet, panel_from_map: Mapping[str, Similarity2]) -> None:
    for name, grid, colour in zip(maps.names, maps.grids, map_colours(maps.names), strict=True):
        if name in panel_from_map:
            image = np.empty((*grid.frame.shape, 4), np.uint8)
            image[..., :3] = np.rint(255.0 * np.array(to_rgb(colour)))
            image[..., 3] = np.where(grid.occupied, round(255.0 * OPACITY), 0)
            _show_image(panel, image, grid.frame, panel_from_map[name], zorder=2.0)


def _show_world(panel: Axes, mission: Mission) -> None:
    panel.add_collection(PolyCollection(mission.world.obstacles, facecolors="#3a3f46", edgecolors="none"))
    if mission.world.fence is not None:
        panel.add_patch(Outline(mission.world.fence, fill=False, edgecolor=FENCE, linestyle="--", linewidth=1.0))
    for index, robot in enumerate(mission.robots):
        path = robot.trajectory.poses
        colour = robot_colour(index)
        panel.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.1, label=f"robot_{index}")
        panel.plot(*path[0, :2], "o", color=colour, markersize=5, markeredgecolor="white")
    panel.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, -0.04), frameon=False, ncols=LEGEND_COLUMNS)
    write_title(panel, mission.world.name, "true paths, starts as dots [m]")


def _show_over_truth(
    panel: Axes, mission: Mission, maps: MapSet, truth: RunTruth, groups: Sequence[GroupRecord]
) -> None:
    panel.add_collection(PolyCollection(mission.world.obstacles, facecolors=TRUE_WALL, edgecolors="none"))
    for group in groups:
        if group.reference_from_map:
            world_from_map = {name: truth.robot(name).truth.world_from_map for name in group.reference_from_map}
            world_from_reference = align_to_world(maps, world_from_map, group.reference_from_map)
            placed = {name: world_from_reference @ place for name, place in group.reference_from_map.items()}
            _show_all_walls(panel, maps, placed)
    write_title(panel, "merged walls", "over the true ones (grey) [m]")
