"""Pictures of the correction of a map, as in the figures of chapter 5 of the thesis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.wording import counted
from mapquilt.merging.morphology_steps import PairSteps, RefinedMatch, TeamSteps
from mapquilt.viz.match_picture import draw_matches
from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.png import default_style
from merge.literature.chen2021.correction import Correction
from merge.literature.chen2021.interest_points import point_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Picture = NDArray[np.uint8]
CORNER_COLOUR = (0, 165, 255)
"""In OpenCV's order blue, green, red."""
PANEL_INCHES = 3.1
DPI = 110


def step_pictures(found: Correction) -> Iterator[tuple[str, Picture]]:
    """Yield each step's name and picture at full size, grey (rows, cols) or BGR (rows, cols, 3)."""
    yield "1-map", found.picture
    yield "2-walls", found.walls
    yield "4-straightened", found.straightened.walls
    yield "5-closed", found.closed
    yield "6-interest-points", point_picture(found.points, found.closed.shape)
    yield "7-main-structure", found.structure
    yield "8-corners", with_corners(found)


def with_corners(found: Correction) -> Picture:
    """Draw the main structure with a ring around each corner."""
    image = cv2.cvtColor(found.structure, cv2.COLOR_GRAY2BGR)
    for u, v in np.rint(found.corners).astype(int).tolist():
        cv2.circle(image, (u, v), 2 * found.half + 1, CORNER_COLOUR, 1, cv2.LINE_AA)
    return np.asarray(image, np.uint8)


def picture_png(picture: Picture) -> bytes:
    done, data = cv2.imencode(".png", picture)
    if not done:
        raise RuntimeError("picture_png: OpenCV could not encode the picture")
    return data.tobytes()


@default_style()
def direction_figure(name: str, found: Correction) -> Figure:
    """Plot the energy of the projections against the direction, and state the sharpness of its maximum."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.4), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    _draw_direction(axes, found)
    axes.set_title(f"{name}: main direction", loc="left", fontsize=10, color=INK, fontweight="bold", parse_math=False)
    return figure


def _draw_direction(axes: Axes, found: Correction) -> None:
    direction = found.direction
    axes.plot(np.linspace(0.0, 90.0, len(direction.energies), endpoint=False), direction.energies, color=ROBOTS[0])
    place = math.degrees(direction.angle)
    axes.axvline(place % 90.0, color=ROBOTS[1], lw=1.0, ls="--")
    axes.set(xlim=(0, 90), ylim=(0, 1.08), xticks=range(0, 91, 15))
    axes.set_xlabel("direction [degrees, modulo 90]", fontsize=8, color=INK)
    axes.set_ylabel("energy of the projections\n[share of the greatest]", fontsize=8, color=INK)
    axes.tick_params(labelsize=7, colors=INK)
    verdict = f"rotated by {-place:.2f} degrees" if direction.clear else "no main direction: not rotated"
    details = f"sharpness {direction.sharpness:.2f}, contrast {direction.contrast:.2f}\n{verdict}"
    axes.text(45.0, 0.03, details, ha="center", fontsize=8, color=INK)


COLUMNS = (
    "map",
    "walls (5.1)",
    "direction (5.2)",
    "rotated, closed (5.2, 5.3)",
    "interest points (5.4)",
    "corrected (5.5)",
)


@default_style()
def sheet_figure(names: Sequence[str], corrections: Sequence[Correction]) -> Figure:
    """Draw a row of steps for each map."""
    from matplotlib.figure import Figure

    size = (PANEL_INCHES * len(COLUMNS), (PANEL_INCHES + 0.25) * len(names))
    figure = Figure(figsize=size, dpi=DPI, layout="constrained")
    axes = figure.subplots(len(names), len(COLUMNS), squeeze=False)
    for row, (name, found) in enumerate(zip(names, corrections, strict=True)):
        _draw_row(axes[row], name, found)
        for column, title in enumerate(COLUMNS if row == 0 else ()):
            axes[0, column].set_title(title, fontsize=10, color=INK, loc="left", fontweight="bold")
    return figure


def _draw_row(axes: NDArray[np.object_], name: str, found: Correction) -> None:
    dots = point_picture(found.points, found.closed.shape)
    if found.half > 1:
        dots = _thickened(dots)
    for place, picture in ((0, found.picture), (1, found.walls), (3, found.closed), (4, dots)):
        _show(axes[place], picture)
    _draw_direction(axes[2], found)
    axes[2].set_box_aspect(0.8)
    _show(axes[5], _thickened(found.structure))
    axes[5].plot(found.corners[:, 0], found.corners[:, 1], "o", ms=4, mfc="none", mec="#E69F00", mew=0.8)
    axes[0].set_ylabel(name, fontsize=10, color=INK, fontweight="bold", parse_math=False)
    details = (
        f"closing {found.closing} px, L = {found.half}",
        counted(len(found.points), "point"),
        counted(len(found.corners), "corner"),
    )
    for place, text in zip((3, 4, 5), details, strict=True):
        axes[place].set_xlabel(text, fontsize=8, color=INK)


def _thickened(picture: Picture) -> Picture:
    """Thicken lines of one pixel, which would not show in a small panel."""
    return np.asarray(cv2.dilate(picture, np.ones((2, 2), np.uint8)), np.uint8)


def _show(axes: Axes, picture: Picture) -> None:
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="antialiased")
    axes.set(xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_color("#d0d4d9")


@default_style()
def match_figure(team: TeamSteps, pair: PairSteps) -> Figure:
    """Draw the corner matches of the best transform of each quarter turn, by falling acceptance index."""
    from matplotlib.figure import Figure

    columns, rows = (2, math.ceil(len(pair.matches) / 2)) if len(pair.matches) > 1 else (1, 1)
    figure = Figure(figsize=(9.0 * columns, 4.9 * rows), dpi=DPI, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for rest in axes[len(pair.matches) :]:
        rest.set_axis_off()
    target, source = (team.maps[k].correction for k in (pair.target, pair.source))
    name = f"{team.names[pair.target]} and {team.names[pair.source]}"
    for number, one in enumerate(pair.matches):
        points = target.corners[one.corners.target], source.corners[one.corners.source]
        draw_matches(
            axes[number], (target.structure, source.structure), points, np.ones(one.corners.inliers, dtype=bool)
        )
        axes[number].set_title(_describe(name if number == 0 else "another quarter turn", one), loc="left", fontsize=10)
    if not pair.matches:
        axes[0].set_title(f"{name}: too few corners agree", loc="left", fontsize=10)
    return figure


def _describe(name: str, one: RefinedMatch) -> str:
    before, after = (("-" if index is None else f"{index:.4f}") for index in (one.index_before, one.index))
    place = one.target_from_source
    return (
        f"{name}: {counted(one.corners.inliers, 'corner pair')} in agreement\nrotated by "
        f"{math.degrees(place.yaw):.2f} degrees, scale {place.scale:.4f}; acceptance index {before}, after ICP {after}"
    )
