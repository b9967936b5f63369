"""Pictures of worlds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mapping.geometry.se2 import SE2
from mapping.wording import counted
from mapquilt.viz.palette import FENCE, INK, robot_colour
from mapquilt.viz.png import default_style, figure_png
from worlds.families.registry import FAMILIES, make_world
from worlds.world import World

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SOLID = "#3a3f46"
SHEET_COLUMNS = 5


@default_style()
def world_picture(world: World, starts: Sequence[SE2], seed: int) -> bytes:
    """Draw a world as PNG: obstacles, dashed fence, starts with their headings, width and height [m]."""
    from matplotlib.figure import Figure

    from mapquilt.viz.panels import label_axes

    width, height = world.size
    long = 9.0 / max(width, height)
    figure = Figure(
        figsize=(max(4.0, width * long) + 1.0, max(3.0, height * long) + 1.2), layout="constrained", dpi=110
    )
    panel = figure.add_subplot()
    draw_world(panel, world)
    label_axes(panel, "m")
    arrow = max(world.size) / 25.0
    for index, start in enumerate(starts):
        tip = (start.x + arrow * math.cos(start.yaw), start.y + arrow * math.sin(start.yaw))
        colour = robot_colour(index)
        panel.annotate("", tip, (start.x, start.y), arrowprops={"arrowstyle": "->", "color": colour, "lw": 1.6})
        panel.plot(start.x, start.y, "o", color=colour, markersize=6, markeredgecolor="white", label=f"robot_{index}")
    _dimension(panel, (0.0, -0.06 * max(world.size)), (width, -0.06 * max(world.size)), f"{width:g} m")
    _dimension(panel, (-0.06 * max(world.size), 0.0), (-0.06 * max(world.size), height), f"{height:g} m")
    panel.set_title(
        f"{world.name}, seed {seed}: {counted(len(world.obstacles), 'solid')}",
        fontsize=10,
        color=INK,
        loc="left",
        parse_math=False,
    )
    if starts:
        panel.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return figure_png(figure)


@default_style()
def sheet_picture(seed: int) -> bytes:
    """Draw one small world of each family on one sheet."""
    from matplotlib.figure import Figure

    rows = math.ceil(len(FAMILIES) / SHEET_COLUMNS)
    figure = Figure(figsize=(3.2 * SHEET_COLUMNS, 2.7 * rows), layout="constrained", dpi=100)
    for index, name in enumerate(FAMILIES):
        panel = figure.add_subplot(rows, SHEET_COLUMNS, index + 1)
        world = make_world(name, seed)
        draw_world(panel, world)
        panel.set_axis_off()
        panel.set_title(f"{name}, {world.size[0]:g} x {world.size[1]:g} m", fontsize=9, color=INK)
    return figure_png(figure)


def draw_world(panel: Axes, world: World) -> None:
    """Draw the obstacles and the fence into a panel, in metres."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Polygon as Outline

    width, height = world.size
    panel.set_aspect("equal")
    panel.add_patch(Outline([(0, 0), (width, 0), (width, height), (0, height)], facecolor="white", edgecolor="#d0d4d9"))
    panel.add_collection(
        PolyCollection(world.obstacles, facecolors=SOLID, edgecolors=SOLID, linewidths=0.4, snap=False)
    )
    if world.fence is not None:
        panel.add_patch(Outline(world.fence, fill=False, edgecolor=FENCE, linestyle="--", linewidth=1.2))
    margin = 0.01 * max(width, height)
    panel.set_xlim(-margin, width + margin)
    panel.set_ylim(-margin, height + margin)
    panel.tick_params(labelsize=7, colors=INK, length=2)


def _dimension(panel: Axes, start: tuple[float, float], end: tuple[float, float], text: str) -> None:
    style = {"arrowstyle": "<->", "color": INK, "lw": 0.8, "shrinkA": 0.0, "shrinkB": 0.0}
    panel.annotate("", end, start, arrowprops=style, annotation_clip=False)
    middle = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0)
    upright = 90.0 if start[0] == end[0] else 0.0
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
    panel.text(*middle, text, ha="center", va="center", rotation=upright, fontsize=8, color=INK, bbox=box)
