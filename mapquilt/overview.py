"""Pictures of a run: the maps and their merge, and the whole against the truth."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon as Outline
from matplotlib.transforms import Affine2D

from mapping.grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.similarity2 import Similarity2
from mapquilt.palette import FENCE, INK, TRUE_WALL, picture, robot_colour
from mapquilt.truth_file import RunTruth
from sim.mission import Mission

COLUMNS = 3
PANEL_INCHES = (5.0, 4.2)


def merge_figure(maps: MapSet, merged: OccupancyGrid, reference_from_map: dict[str, Similarity2]) -> Figure:
    """The merged map with each map's walls in a colour of its own, and every map as the merger got it."""
    figure, panels = _panels(1 + len(maps))
    _show_grid(panels[0], merged, "merged map")
    for index, name in enumerate(maps.names):
        if name in reference_from_map:
            _show_walls(panels[0], maps.grids[index], reference_from_map[name], robot_colour(index))
        verdict = "" if name in reference_from_map else " (not merged)"
        _show_grid(panels[index + 1], maps.grids[index], name + verdict, robot_colour(index))
    return figure


def overview_figure(
    mission: Mission,
    maps: MapSet,
    truth: RunTruth,
    merged: OccupancyGrid,
    reference: str,
    reference_from_map: dict[str, Similarity2],
) -> Figure:
    """The world with the paths, the merged grid, the merged walls over the truth, and each robot's grid."""
    figure, panels = _panels(3 + len(maps))
    _show_world(panels[0], mission)
    _show_grid(panels[1], merged, f"merged map: {len(reference_from_map)} of {len(maps)} maps, frame of {reference}")
    _show_over_truth(panels[2], mission, maps, truth, reference, reference_from_map)
    for index, name in enumerate(maps.names):
        scale = truth.robot(name).truth.world_from_map.scale
        resolution = maps.grids[index].frame.resolution
        title = f"{name}: states {resolution:g} m a cell, truly {resolution * scale:.3f} m"
        _show_grid(panels[3 + index], maps.grids[index], title, robot_colour(index))
    return figure


def _panels(count: int) -> tuple[Figure, list[Axes]]:
    columns = min(COLUMNS, count)
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(PANEL_INCHES[0] * columns, PANEL_INCHES[1] * rows), layout="constrained", dpi=110)
    axes = [figure.add_subplot(rows, columns, index + 1) for index in range(count)]
    for panel in axes:
        panel.set_aspect("equal")
        panel.tick_params(labelsize=7, colors=INK, length=2)
        for spine in panel.spines.values():
            spine.set_color("#d0d4d9")
    return figure, axes


def _title(panel: Axes, text: str, colour: str = INK) -> None:
    panel.set_title(text, fontsize=9, color=colour, loc="left", parse_math=False)


def _show_grid(panel: Axes, grid: OccupancyGrid, title: str, colour: str = INK) -> None:
    """Draw in the map's own metres, turned as its origin is."""
    frame = grid.frame
    image = panel.imshow(picture(grid)[::-1], origin="upper", interpolation="antialiased")
    image.set_transform(Affine2D(frame.metre_from_pixel()) + panel.transData)
    rows, cols = frame.shape
    corners = frame.metres_from_cells(np.array([(0, 0), (0, cols), (rows, 0), (rows, cols)]) - 0.5)
    (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
    panel.set(xlim=(left, right), ylim=(low, high))
    _title(panel, title, colour)


def _show_walls(panel: Axes, grid: OccupancyGrid, frame_from_map: Similarity2, colour: str) -> None:
    points = frame_from_map.apply(grid.frame.metres_from_cells(np.argwhere(grid.occupied)))
    panel.plot(points[:, 0], points[:, 1], ",", color=colour, alpha=0.8, rasterized=True)


def _show_world(panel: Axes, mission: Mission) -> None:
    panel.add_collection(PolyCollection(mission.world.obstacles, facecolors="#3a3f46", edgecolors="none"))
    if mission.world.fence is not None:
        panel.add_patch(Outline(mission.world.fence, fill=False, edgecolor=FENCE, linestyle="--", linewidth=1.0))
    for index, robot in enumerate(mission.robots):
        path = robot.trajectory.poses
        colour = robot_colour(index)
        panel.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.1, label=f"robot_{index}")
        panel.plot(*path[0, :2], "o", color=colour, markersize=5, markeredgecolor="white")
    _frame_world(panel, mission)
    panel.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.06), frameon=False, ncols=4)
    _title(panel, f"{mission.world.name}: true paths, starts as dots [m]")


def _frame_world(panel: Axes, mission: Mission) -> None:
    width, height = mission.world.size
    panel.set_xlim(-0.3, width + 0.3)
    panel.set_ylim(-0.3, height + 0.3)


def _show_over_truth(
    panel: Axes,
    mission: Mission,
    maps: MapSet,
    truth: RunTruth,
    reference: str,
    reference_from_map: dict[str, Similarity2],
) -> None:
    panel.add_collection(PolyCollection(mission.world.obstacles, facecolors=TRUE_WALL, edgecolors="none"))
    world_from_reference = truth.robot(reference).truth.world_from_map
    for index, name in enumerate(maps.names):
        if name in reference_from_map:
            _show_walls(panel, maps.grids[index], world_from_reference @ reference_from_map[name], robot_colour(index))
    _frame_world(panel, mission)
    _title(panel, "merged walls over the true ones (grey) [m]")
