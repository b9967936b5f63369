"""Pictures of a run: the maps and their merge, and the whole against the truth."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapping.wording import counted, merged_count
from mapquilt.viz.palette import CONFLICT, CONFLICT_FREE, FREE, UNKNOWN, at_screen_size, map_colours, of_255, picture
from mapquilt.viz.panels import Extent, lay_out, short_name, write_title
from mapquilt.viz.png import default_style
from merge.records.bent_map import bent_grid
from merge.records.result import MergedGroup

LONGEST_REFERENCE = 20
"""Number of letters of a name that leave room for other words."""

OPACITY = 0.9
"""Opacity of a map's walls where they cover those of other maps."""


@default_style()
def merge_figure(maps: MapSet, groups: Sequence[MergedGroup]) -> Figure:
    """Draw the merged map of each group, the walls of its maps, bent as they were, and every input map.

    The merged map is that of its file, with the cells in conflict in red, pale where it has them free. A group of one
    map is only drawn if it is the first.
    """
    shown = [group for index, group in enumerate(groups) if index == 0 or len(group.reference_from_map) > 1]
    overlays = [group for group in shown if len(group.reference_from_map) > 1]
    figure, panels = lay_out(
        [extent_of(grid) for grid in (*(group.merged for group in (*shown, *overlays)), *maps.grids)],
        units=[*(maps.units[maps.names.index(group.reference)] for group in (*shown, *overlays)), *maps.units],
    )
    number_of = {name: number for number, group in enumerate(shown, 1) for name in group.reference_from_map}
    for number, (panel, group) in enumerate(zip(panels, shown, strict=False), 1):
        show_grid(panel, group.merged)
        _show_conflicts(panel, group)
        conflicts = int(np.count_nonzero(group.conflicts.occupied))
        details = f", {counted(conflicts, 'cell')} in conflict (red; pale if free)" if conflicts else ""
        write_title(
            panel,
            merged_title(group.reference, group.reference_from_map, number if len(shown) > 1 else None),
            f"{merged_count(len(group.reference_from_map), len(maps))}, frame of "
            f"{short_name(group.reference, LONGEST_REFERENCE)}{details}",
        )
    for panel, group in zip(panels[len(shown) :], overlays, strict=False):
        show_grid(panel, group.merged, walls=False)
        show_all_walls(panel, _bent(maps, group), group.reference_from_map)
        of_group = "" if len(shown) == 1 else f" of merged map {number_of[group.reference]}"
        write_title(panel, f"walls{of_group}", "of each map in its colour, over the free cells")
    colours = map_colours(maps.names)
    for panel, name, grid, colour in zip(
        panels[len(shown) + len(overlays) :], maps.names, maps.grids, colours, strict=True
    ):
        show_grid(panel, grid)
        joined = "" if len(shown) == 1 else f"in merged map {number_of.get(name)}"
        merged = any(name in each.reference_from_map for each in overlays)
        write_title(panel, name, joined if merged else "not merged", colour)
    return figure


def _bent(maps: MapSet, group: MergedGroup) -> MapSet:
    """Bend the maps that were bent before they were fused."""
    grids = tuple(
        bent_grid(grid, group.bends[name].bend) if name in group.bends else grid
        for name, grid in zip(maps.names, maps.grids, strict=True)
    )
    return dataclasses.replace(maps, grids=grids)


def _show_conflicts(panel: Axes, group: MergedGroup) -> None:
    conflicts, merged = at_screen_size(group.conflicts), at_screen_size(group.merged).occupied
    for cells, colour in ((conflicts.occupied & ~merged, CONFLICT_FREE), (conflicts.occupied & merged, CONFLICT)):
        show_walls(panel, OccupancyGrid(conflicts.frame, cells.astype(np.float32)), colour, Similarity2(), zorder=1.0)


def merged_title(reference: str, placed: Mapping[str, Similarity2], number: int | None) -> str:
    """Title the map of a group; one that holds a single map by its name."""
    if len(placed) == 1:
        return f"{short_name(reference, LONGEST_REFERENCE)} alone"
    return "merged map" if number is None else f"merged map {number}"


def extent_of(grid: OccupancyGrid) -> Extent:
    """Return the extent of a map's known cells, in its own metres."""
    frame, known = grid.frame, grid.known
    if not known.any():
        known = np.ones(frame.shape, bool)
    rows, last = np.flatnonzero(known.any(axis=1)), frame.shape[1] - 1
    ends = known[rows].argmax(axis=1), last - known[rows, ::-1].argmax(axis=1)  # the outermost known cells of each row
    metres = frame.metres_from_cells(np.concatenate([np.column_stack((rows, end)) for end in ends]))
    (left, low), (right, high) = metres.min(axis=0), metres.max(axis=0)
    return Extent(left - frame.resolution, right + frame.resolution, low - frame.resolution, high + frame.resolution)


def show_grid(panel: Axes, grid: OccupancyGrid, walls: bool = True) -> None:
    panel.set_facecolor(of_255(UNKNOWN))
    grid = at_screen_size(grid)
    image = picture(grid) if walls else picture(grid, wall=FREE)
    _show_image(panel, image, grid.frame, Similarity2())


def _show_image(
    panel: Axes, image: NDArray[np.uint8], frame: GridFrame, panel_from_map: Similarity2, zorder: float = 0.0
) -> None:
    """Draw a picture of a map, row 0 lowest, at its origin and transform."""
    placed = Affine2D(np.vstack((panel_from_map.matrix(), (0.0, 0.0, 1.0))))
    drawn = panel.imshow(image[::-1], origin="upper", interpolation="antialiased", aspect="auto", zorder=zorder)
    drawn.set_transform(Affine2D(frame.metre_from_pixel()) + placed + panel.transData)


def show_all_walls(panel: Axes, maps: MapSet, panel_from_map: Mapping[str, Similarity2]) -> None:
    for name, grid, colour in zip(maps.names, maps.grids, map_colours(maps.names), strict=True):
        if name in panel_from_map:
            show_walls(panel, grid, colour, panel_from_map[name], zorder=2.0)


def show_walls(panel: Axes, grid: OccupancyGrid, colour: str, panel_from_map: Similarity2, zorder: float) -> None:
    """Draw the occupied cells of a map alone, in one colour."""
    grid = at_screen_size(grid)
    image = np.empty((*grid.frame.shape, 4), np.uint8)
    image[..., :3] = np.rint(255.0 * np.array(to_rgb(colour)))
    image[..., 3] = np.where(grid.occupied, round(255.0 * OPACITY), 0)
    _show_image(panel, image, grid.frame, panel_from_map, zorder=zorder)
