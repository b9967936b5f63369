"""Picture of a pair and one answer: target, source, and both overlaid."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapquilt.viz.palette import FREE, ROBOTS, UNKNOWN, WALL, at_screen_size

SIDE, GAP = 300, 10
"""Side of a panel, and gap between two [pixels]."""

MARGIN = 0.03
FARTHEST = 1.5
"""Largest distance of the source from the target in the overlay, in diagonals of the target."""

MOST_SIDES_AWAY = 50.0

TRUE_PLACE = "#009E73"

Picture = NDArray[np.uint8]


def card_picture(
    target: OccupancyGrid, source: OccupancyGrid, answer: Similarity2 | None, truth: Similarity2 | None
) -> Picture:
    """Draw the target, the source, and the source's walls over the target's where the answer puts them, as RGB
    (SIDE, 3 SIDE + 2 GAP, 3). The source's true bounding box is dashed."""
    target, source = at_screen_size(target), at_screen_size(source)
    panels = [_draw_map(target), _draw_map(source), _overlay(target, source, answer, truth)]
    space = np.full((SIDE, GAP, 3), 255, np.uint8)
    return np.hstack((panels[0], space, panels[1], space, panels[2]))


def _draw_map(grid: OccupancyGrid) -> Picture:
    canvas = _Canvas.around(_corners(grid))
    free, walls = _free_and_walls(canvas, grid, Similarity2.identity())
    image = _blank(canvas)
    image[free] = FREE
    image[walls] = WALL
    return image[::-1]


def _blank(canvas: _Canvas) -> Picture:
    return np.full((*canvas.frame.shape, 3), UNKNOWN, np.uint8)


@dataclass(frozen=True)
class _Canvas:
    """A square of the target's metres, ``frame`` of SIDE x SIDE cells."""

    frame: GridFrame

    @staticmethod
    def around(points: NDArray[np.float64]) -> _Canvas:
        low, high = points.min(axis=0), points.max(axis=0)
        middle, side = (low + high) / 2.0, (1.0 + 2.0 * MARGIN) * float((high - low).max())
        corner = middle - side / 2.0
        return _Canvas(GridFrame(side / SIDE, SE2(float(corner[0]), float(corner[1]), 0.0), (SIDE, SIDE)))

    def centres(self) -> NDArray[np.float64]:
        """Return the centres of all pixels (SIDE * SIDE, 2), row by row."""
        return self.frame.metres_from_cells(np.argwhere(np.ones(self.frame.shape, dtype=bool)))

    def mask(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Mark the pixels (SIDE, SIDE) that hold a point."""
        cells = _cells(self.frame, points)
        cells = cells[self.frame.contains(cells)]
        mask = np.zeros(self.frame.shape, dtype=bool)
        mask[cells[:, 0], cells[:, 1]] = True
        return mask

    def pixels(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """Convert points to pixels (N, 2) x, y of the picture, y down."""
        cells = _cells(self.frame, points)
        return np.stack((cells[:, 1], SIDE - 1 - cells[:, 0]), axis=-1).astype(np.int32)


def _overlay(
    target: OccupancyGrid, source: OccupancyGrid, answer: Similarity2 | None, truth: Similarity2 | None
) -> Picture:
    corners, reach = _corners(target), FARTHEST * target.known_diagonal
    low, high = corners.min(axis=0) - reach, corners.max(axis=0) + reach
    places = [place.apply(_corners(source)) for place in (answer, truth) if place is not None]
    canvas = _Canvas.around(np.concatenate([corners, *(np.clip(place, low, high) for place in places)]))
    image = _draw_both(canvas, target, source, answer)[::-1].copy()
    if answer is not None:
        _outline(image, canvas.pixels(answer.apply(_corners(source))), ROBOTS[1], dashed=False)
    if truth is not None:
        _outline(image, canvas.pixels(truth.apply(_corners(source))), TRUE_PLACE, dashed=True)
    return image


def _draw_both(canvas: _Canvas, target: OccupancyGrid, source: OccupancyGrid, answer: Similarity2 | None) -> Picture:
    free, walls = _free_and_walls(canvas, target, Similarity2.identity())
    image = _blank(canvas)
    if answer is None:
        image[free] = FREE
        image[walls] = _rgb(ROBOTS[0])
        return image
    other_free, other_walls = _free_and_walls(canvas, source, answer)
    image[free | other_free] = FREE
    image[other_walls] = _rgb(ROBOTS[1])
    image[walls] = _rgb(ROBOTS[0])
    near = cv2.dilate(other_walls.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    image[walls & near] = WALL
    return image


def _free_and_walls(
    canvas: _Canvas, grid: OccupancyGrid, target_from_grid: Similarity2
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Mark free and wall pixels (SIDE, SIDE). Thin walls stay visible, and large cells leave no gaps."""
    cells = _cells(grid.frame, target_from_grid.inverse().apply(canvas.centres()))
    inside = grid.frame.contains(cells)
    values = np.zeros(len(cells), np.float32)
    values[inside] = grid.log_odds[cells[inside, 0], cells[inside, 1]]
    values = values.reshape(canvas.frame.shape)
    walls = canvas.mask(target_from_grid.apply(grid.frame.metres_from_cells(np.argwhere(grid.occupied))))
    return values < 0.0, walls | (values > 0.0)


def _cells(frame: GridFrame, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Convert points [m] to cells (N, 2); points far outside are clipped to where integers still hold them."""
    reach = MOST_SIDES_AWAY * max(frame.shape) * frame.resolution
    corner = np.array([frame.origin.x, frame.origin.y])
    return frame.cells_from_metres(np.clip(points, corner - reach, corner + reach))


def _corners(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the corners (4, 2) of the box around the known cells [m], in order around it."""
    rows, cols = np.nonzero(grid.known)
    low, high = (rows.min(), cols.min()), (rows.max(), cols.max())
    box = np.array([(low[0], low[1]), (low[0], high[1]), (high[0], high[1]), (high[0], low[1])])
    return grid.frame.metres_from_cells(box)


def _outline(image: Picture, corners: NDArray[np.int32], colour: str, dashed: bool) -> None:
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.hypot(*(stop - start)))
        parts = max(1, int(length / 7.0)) if dashed else 1
        along = start + np.linspace(0.0, 1.0, parts + 1)[:, None] * (stop - start)
        for first in range(0, parts, 2):
            ends = [tuple(int(v) for v in point) for point in along[first : first + 2]]
            cv2.line(image, ends[0], ends[1], _rgb(colour), 1, cv2.LINE_AA)


def _rgb(colour: str) -> tuple[int, int, int]:
    from matplotlib.colors import to_rgb

    red, green, blue = (round(255 * part) for part in to_rgb(colour))
    return red, green, blue
