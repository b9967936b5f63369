"""Draw the overview of a scored run: maps and merge beside the truth."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.wording import merged_count
from mapquilt.evaluation.map_quality import align_to_world
from mapquilt.merging.merge_file import GroupRecord
from mapquilt.runs.truth_file import RunTruth
from mapquilt.scoring.run_score import RunScore
from mapquilt.scoring.true_scene import TrueScene
from mapquilt.viz.merge_picture import LONGEST_REFERENCE, extent_of, merged_title, show_all_walls, show_grid
from mapquilt.viz.palette import TRUE_WALL, map_colours, robot_colour
from mapquilt.viz.panels import lay_out, short_name, write_title
from mapquilt.viz.png import default_style

LEGEND_COLUMNS, LEGEND_ROW_INCHES = 5, 0.17
TRUE_OBSTACLE = "#3a3f46"


@default_style()
def overview_figure(
    scene: TrueScene,
    maps: MapSet,
    truth: RunTruth,
    groups: Sequence[tuple[GroupRecord, OccupancyGrid]],
    score: RunScore,
) -> Figure:
    """Draw the world with the paths, the merged grid of each group, the merged walls over the truth, and each map."""
    legend = LEGEND_ROW_INCHES * math.ceil(len(scene.paths) / LEGEND_COLUMNS)
    extents = [extent_of(merged) for _, merged in groups]
    figure, panels = lay_out([scene.extent, *extents, scene.extent, *map(extent_of, maps.grids)], legend)
    _show_world(panels[0], scene)
    for number, (panel, (group, merged)) in enumerate(zip(panels[1:], groups, strict=False)):
        show_grid(panel, merged)
        title = merged_title(group.reference, group.reference_from_map, number + 1 if len(groups) > 1 else None)
        details = _quality(score, group)
        write_title(
            panel,
            title,
            f"{merged_count(len(group.reference_from_map), len(maps))}, frame of "
            f"{short_name(group.reference, LONGEST_REFERENCE)}{details}",
        )
    _show_over_truth(panels[1 + len(groups)], scene, maps, truth, [group for group, _ in groups])
    colours = map_colours(maps.names)
    for panel, name, grid, colour in zip(panels[2 + len(groups) :], maps.names, maps.grids, colours, strict=True):
        show_grid(panel, grid)
        scale, resolution = truth.robot(name).truth.world_from_map.scale, grid.frame.resolution
        write_title(panel, name, f"states {resolution:g} m a cell, truly {resolution * scale:.3f} m", colour)
    return figure


def _quality(score: RunScore, group: GroupRecord) -> str:
    found = next((each.quality for each in score.merged if each.reference == group.reference), None)
    return "" if found is None else f"; free IoU {found.iou_free:.2f}, walls F1 {found.f1_walls:.2f}"


def _show_world(panel: Axes, scene: TrueScene) -> None:
    scene.draw_walls(panel, TRUE_OBSTACLE)
    for index, (name, path) in enumerate(scene.paths.items()):
        colour = robot_colour(index)
        panel.plot(path[:, 0], path[:, 1], color=colour, linewidth=1.1, label=name)
        panel.plot(*path[0, :2], "o", color=colour, markersize=5, markeredgecolor="white")
    panel.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, -0.06), frameon=False, ncols=LEGEND_COLUMNS)
    write_title(panel, scene.name, "true paths, starts as dots")


def _show_over_truth(
    panel: Axes, scene: TrueScene, maps: MapSet, truth: RunTruth, groups: Sequence[GroupRecord]
) -> None:
    scene.draw_walls(panel, TRUE_WALL)
    for group in groups:
        if group.reference_from_map:
            world_from_map = {name: truth.robot(name).truth.world_from_map for name in group.reference_from_map}
            world_from_reference = align_to_world(maps, world_from_map, group.reference_from_map)
            placed = {name: world_from_reference @ place for name, place in group.reference_from_map.items()}
            show_all_walls(panel, maps, placed)
    write_title(panel, "merged walls", "over the true ones (grey)")
