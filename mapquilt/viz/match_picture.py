"""Picture of matched points of two maps, side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mapquilt.viz.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

AGREEING, OTHER = "#009E73", "#D55E00"
GAP = 0.06
"""Gap between the pictures, as a share of the wider one."""


def draw_matches(
    axes: Axes,
    pictures: tuple[NDArray[np.uint8], NDArray[np.uint8]],
    points: tuple[NDArray[np.float64], NDArray[np.float64]],
    agreeing: NDArray[np.bool_],
) -> None:
    """Draw two grey pictures with lines between matched pixels (M, 2) u, v of each; inliers in green."""
    left, right = pictures
    gap = GAP * max(left.shape[1], right.shape[1])
    shift, height = left.shape[1] + gap, max(left.shape[0], right.shape[0])
    for picture, start in ((left, 0.0), (right, shift)):
        rows, cols = picture.shape
        axes.imshow(
            picture,
            cmap="gray",
            vmin=0,
            vmax=255,
            extent=(start - 0.5, start + cols - 0.5, rows - 0.5, -0.5),
            interpolation="antialiased",
        )
    for wanted, colour, width in ((False, OTHER, 0.5), (True, AGREEING, 0.7)):
        here, there = points[0][agreeing == wanted], points[1][agreeing == wanted]
        axes.plot(
            np.stack((here[:, 0], there[:, 0] + shift)), np.stack((here[:, 1], there[:, 1])), color=colour, lw=width
        )
        axes.plot(here[:, 0], here[:, 1], ".", color=colour, ms=2.5)
        axes.plot(there[:, 0] + shift, there[:, 1], ".", color=colour, ms=2.5)
    axes.set(xlim=(-0.5, shift + right.shape[1] - 0.5), ylim=(height - 0.5, -0.5), xticks=[], yticks=[])
    axes.set_aspect("equal")
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.title.set_color(INK)
