"""Draw the packages and the flow of data: ``python docs/architecture_picture.py docs/architecture.png``."""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

ROOMS = {
    "worlds": ("#2a9d8f", "places to explore,\nas polygons"),
    "sim": ("#457b9d", "robots drive and scan\nin PyBullet"),
    "mapping": ("#6d597a", "scans become\noccupancy grids"),
    "merge": ("#e76f51", "grids become\none map"),
    "mapquilt": ("#264653", "score, study,\nreport"),
}
FLOW = ("world", "clean mission", "logs, maps", "transforms, verdicts,\nmerged map", "score")
STEPS = ("prepare", "propose", "align", "verify", "accept", "many maps", "fuse")
WIDTH, HEIGHT, GAP = 2.0, 1.15, 0.55


def picture() -> Figure:
    """Return the figure: packages in the order of the data, the data between them, the steps of the merge below."""
    figure = Figure(figsize=(11.5, 4.2), dpi=130)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-0.3, 5 * WIDTH + 4 * GAP + 0.3), ylim=(-0.75, 3.25))
    axes.axis("off")
    for column, (name, (colour, about)) in enumerate(ROOMS.items()):
        left = column * (WIDTH + GAP)
        _box(axes, left, 1.4, WIDTH, HEIGHT, colour)
        axes.text(left + WIDTH / 2, 2.2, f"{name}/", ha="center", color="white", weight="bold", size=13)
        axes.text(left + WIDTH / 2, 1.55, about, ha="center", color="white", size=9)
        axes.text(
            left + WIDTH / 2, 2.75, FLOW[column], ha="center", va="bottom", color="#333333", size=9, style="italic"
        )
        if column:
            _arrow(axes, left - GAP + 0.08, 1.975, left - 0.08, 1.975)
    merge = 3 * (WIDTH + GAP) + WIDTH / 2
    side = (5 * WIDTH + 4 * GAP) / len(STEPS)
    for column, step in enumerate(STEPS):
        _box(axes, column * side + 0.06, 0.15, side - 0.12, 0.5, "#f4a261")
        axes.text(column * side + side / 2, 0.4, step, ha="center", va="center", size=10, color="#222222")
        if column:
            _arrow(axes, column * side - 0.07, 0.4, column * side + 0.07, 0.4)
    for end in (0.06, len(STEPS) * side - 0.06):
        axes.plot((merge, end), (1.4, 0.65), color="#e76f51", linewidth=0.8, linestyle=":")
    axes.text(
        0.0,
        -0.55,
        "mapping imports no other package; worlds, sim and merge import it; sim imports worlds; mapquilt imports all.",
        size=9,
        color="#333333",
    )
    return figure


def _box(axes: Axes, x: float, y: float, width: float, height: float, colour: str) -> None:
    style = "round,pad=0,rounding_size=0.08"
    axes.add_patch(FancyBboxPatch((x, y), width, height, boxstyle=style, facecolor=colour, edgecolor="none"))


def _arrow(axes: Axes, x0: float, y0: float, x1: float, y1: float) -> None:
    axes.annotate("", (x1, y1), (x0, y0), arrowprops={"arrowstyle": "-|>", "color": "#333333", "linewidth": 1.4})


if __name__ == "__main__":
    picture().savefig(Path(sys.argv[1]))
