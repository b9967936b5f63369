"""Overview of disturbances: one map of each kind before and after."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.viz.pair_card import card_picture
from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.png import default_style, figure_png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 2
CARD_INCHES = (7.6, 2.85)
HEADER_INCHES = 0.7
LEGEND = ((0.45, "before", ROBOTS[0]), (0.54, "after, nearest", ROBOTS[1]), (0.68, "both", INK))

Card = tuple[OccupancyGrid, OccupancyGrid, Similarity2]


def overview_png(cards: Mapping[str, Card]) -> bytes:
    """Draw a card for each kind: the map before, after, and both, laid upon each other as their truth says.

    A card holds the two maps and the motion ``before_from_after``.
    """
    return figure_png(_figure(cards))


@default_style()
def _figure(cards: Mapping[str, Card]) -> Figure:
    from matplotlib.figure import Figure

    columns = min(COLUMNS, len(cards))
    rows = math.ceil(len(cards) / columns)
    height = rows * CARD_INCHES[1] + HEADER_INCHES
    figure = Figure(figsize=(columns * CARD_INCHES[0], height), dpi=100, facecolor="white")
    top = 1.0 - 0.35 / height
    figure.text(0.012, top, "Before, after, and both", fontsize=14, color=INK, va="center", weight="bold")
    for place, words, colour in LEGEND:
        figure.text(place, top, f"■ {words}", fontsize=10, color=colour, va="center")
    for index, (kind, (before, after, motion)) in enumerate(cards.items()):
        row, column = divmod(index, columns)
        bottom = (height - HEADER_INCHES - (row + 1) * CARD_INCHES[1]) / height
        box = (column / columns + 0.012, bottom + 0.012, 1 / columns - 0.024, 0.86 * CARD_INCHES[1] / height)
        axes = figure.add_axes(box)
        axes.imshow(card_picture(before, after, motion, None), interpolation="antialiased", aspect="auto")
        axes.set_axis_off()
        axes.set_title(kind, fontsize=11, loc="left", color=INK, fontweight="bold", pad=4.0)
    return figure
