"""Small pictures of a pair: both maps, and the two overlaid by the answer and by the truth, on one canvas."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapping.io.map_file import load_map
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.viz.palette import ROBOTS, WALL

LONGEST = 480
"""Pixels of a picture's longer side."""
MARGIN = 0.03
SAMPLES = 2
"""Points a side at which a pixel looks up a map."""
KEPT = 64
"""Maps that stay loaded: methods and pairs share them."""
FARTHEST = 0.75
"""Largest distance of an answer in the picture, in diagonals of the box around both maps."""

NOTHING, FREE, TARGET, SOURCE, BOTH = range(5)
COLOURS = ((0, 0, 0), (255, 255, 255), *(tuple(bytes.fromhex(colour[1:])) for colour in ROBOTS[:2]), WALL)
"""Colours of the kinds of pixels; the first is transparent."""

Kinds = NDArray[np.uint8]


@dataclass(frozen=True)
class PairPictures:
    """Data addresses of PNGs; None if there is nothing to show."""

    target: str
    source: str
    by_answer: str | None
    by_truth: str | None
    by_alternative: str | None


class Painter:
    """Draws pairs, and keeps the last maps, which methods and pairs share, for as long as it lives."""

    def __init__(self) -> None:
        self._grid = lru_cache(maxsize=KEPT)(_load)
        self._alone = lru_cache(maxsize=8 * KEPT)(self._draw_alone)

    def draw(self, answer: EvaluatedPair) -> PairPictures:
        """Draw one pair. Raises ``ValueError`` or ``OSError`` naming a map file that cannot be read."""
        files = answer.pair.target_file, answer.pair.source_file
        if files[0] is None or files[1] is None:
            raise ValueError(f"{answer.pair.title}: has no map files")
        target, source = self._grid(files[0]), self._grid(files[1])
        truth = answer.truth.target_from_source
        other = None if answer.alternative is None else answer.alternative.target_from_source
        canvas = _canvas(target, source, truth, answer.answer)

        def overlay(place: Similarity2 | None, on: GridFrame) -> str | None:
            return None if place is None else _address(_overlay(on, target, source, place))

        return PairPictures(
            target=self._alone(files[0], TARGET),
            source=self._alone(files[1], SOURCE),
            by_answer=overlay(answer.answer, canvas),
            by_truth=overlay(truth, canvas),
            by_alternative=None if other is None else overlay(other, _canvas(target, source, truth, other)),
        )

    def _draw_alone(self, path: Path, wall: int) -> str:
        grid = self._grid(path)
        return _address(_kinds(_looked_up(grid, Similarity2.identity(), _around(_corners(grid))), wall))


def _load(path: Path) -> OccupancyGrid:
    return load_map(path).grid


def _looked_up(grid: OccupancyGrid, frame_from_grid: Similarity2, frame: GridFrame) -> NDArray[np.float32]:
    return resampled(grid, frame_from_grid, frame, SAMPLES)


def _overlay(canvas: GridFrame, target: OccupancyGrid, source: OccupancyGrid, target_from_source: Similarity2) -> Kinds:
    below = _kinds(_looked_up(target, Similarity2.identity(), canvas), TARGET)
    above = _kinds(_looked_up(source, target_from_source, canvas), SOURCE)
    shown = np.where(above > FREE, above, np.where(below == NOTHING, above, below))
    near = cv2.dilate((above == SOURCE).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    shown[below == TARGET] = TARGET
    shown[(below == TARGET) & near] = BOTH
    return shown


def _kinds(log_odds: NDArray[np.float32], wall: int) -> Kinds:
    kinds = np.full(log_odds.shape, NOTHING, np.uint8)
    kinds[log_odds < 0.0] = FREE
    kinds[log_odds > 0.0] = wall
    return kinds


def _canvas(
    target: OccupancyGrid, source: OccupancyGrid, truth: Similarity2 | None, answer: Similarity2 | None
) -> GridFrame:
    """Return a frame around both maps at the truth, and around the source at the answer as far as it is near."""
    corners = _corners(target)
    if truth is not None:
        corners = np.concatenate([corners, truth.apply(_corners(source))])
    if answer is not None:
        low, high = corners.min(axis=0), corners.max(axis=0)
        reach = FARTHEST * float(np.hypot(*(high - low)))
        corners = np.concatenate([corners, np.clip(answer.apply(_corners(source)), low - reach, high + reach)])
    return _around(corners)


def _around(points: NDArray[np.float64]) -> GridFrame:
    low, high = points.min(axis=0), points.max(axis=0)
    side = float((high - low).max())
    low, high = low - MARGIN * side, high + MARGIN * side
    resolution = float((high - low).max()) / LONGEST
    cols, rows = (max(1, int(np.ceil(length / resolution - 1e-9))) for length in high - low)
    return GridFrame(resolution, SE2(float(low[0]), float(low[1]), 0.0), (rows, cols))


def _corners(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the corners (4, 2) of the box around the known cells [m]."""
    rows, cols = np.nonzero(grid.known)
    low, high = (rows.min() - 0.5, cols.min() - 0.5), (rows.max() + 0.5, cols.max() + 0.5)
    return grid.frame.metres_from_cells(np.array([low, (low[0], high[1]), high, (high[0], low[1])]))


def _address(kinds: Kinds) -> str:
    image = Image.fromarray(kinds[::-1].copy(), mode="P")
    image.putpalette([value for colour in COLOURS for value in colour])
    buffer = io.BytesIO()
    image.save(buffer, format="PNG", transparency=NOTHING, bits=4)
    return png_address(buffer.getvalue())


def png_address(png: bytes) -> str:
    """Encode a PNG as a data address."""
    return "data:image/png;base64," + base64.b64encode(png).decode()
