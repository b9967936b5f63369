"""Map merging by rectangles of free space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.validation import require_valid
from merge.literature.acceptance import accept_by_score, no_answer
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import centres
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal

Boxes = NDArray[np.float64]
"""Rows left, low, right, high."""


@dataclass(frozen=True, eq=False)
class FreeRectangles:
    """Rectangles (N, 4) of free space, in cells of the map turned upright: ``upright_from_map`` turns its walls onto
    the axes."""

    upright_from_map: Similarity2
    boxes: Boxes


@dataclass(frozen=True, eq=False)
class Match:
    """A transform from upright source to upright target, and the pairs (M,) and (M,) of rectangles that it matches."""

    target_from_source: Similarity2
    there: NDArray[np.intp]
    here: NDArray[np.intp]


@dataclass(frozen=True)
class Rectangles:
    """Park et al. 2016, "Map merging of rotated, corrupted, and different scale maps using rectangular features".

    Published, as far as it was at hand, by title and citations: the features are rectangles of free space, and the maps
    may differ in rotation and scale.

    Chosen: the map is turned so that its main walls lie along the axes. Its free space is smoothed by a median, and all
    maximal empty rectangles in it are listed, which cannot grow to any side. The largest are kept, but those that
    resemble a larger one. Two rectangles of nearly the same proportions, at any of the four quarter turns, give a
    transform; that which matches most rectangles wins, fitted to their corners.

    - ``median_cells``: side of the median's window; ``least_side_cells``: shorter rectangles are left out;
    - ``largest``, ``kept``: number of rectangles that are listed, and left of those;
    - ``alike``: two rectangles resemble one another from this intersection over union on;
    - ``tolerance``: rectangles match if sides and centres differ by at most this share of their mean side;
    - ``least_matches``: an answer is accepted if it matches so many; its confidence is 1/2 there.
    """

    median_cells: int = 5
    least_side_cells: int = 8
    largest: int = 400
    kept: int = 60
    alike: float = 0.7
    tolerance: float = 0.08
    proposals: int = 8
    least_matches: int = 8

    def __post_init__(self) -> None:
        require_valid(self, shares=("alike", "tolerance"))
        if self.median_cells % 2 == 0:
            raise ValueError(f"Rectangles: median_cells is {self.median_cells}, must be odd")

    def describe(self, prepared: PreparedMap) -> FreeRectangles:
        """Turn the map upright, and list its rectangles of free space; none on a map without walls."""
        points = centres(prepared.grid.occupied)
        if not len(points):
            return FreeRectangles(Similarity2(), np.empty((0, 4)))
        free = cv2.medianBlur(prepared.grid.free.astype(np.uint8), self.median_cells).astype(np.uint8)
        upright, turned = _upright(free, wall_direction(points))
        boxes, count = _maximal_rectangles(turned.astype(np.bool_), self.least_side_cells, self.largest)
        found = boxes[:count]
        found = found[np.argsort(-_areas(found), kind="stable")]
        return FreeRectangles(upright, _distinct(found, self.alike, self.kept))

    def propose(
        self, target: FreeRectangles, source: FreeRectangles, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the transforms that match most rectangles, fitted within the bounds of the scale."""
        found = [self._fitted(target, source, match, scale) for match in self._matches(target, source, scale)]
        return tuple(Proposal(each) for each in found if each is not None)

    def published(
        self, target: FreeRectangles, source: FreeRectangles, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the transform that matches most rectangles, accepted from ``least_matches`` on."""
        for match in self._matches(target, source, scale):
            fitted = self._fitted(target, source, match, scale)
            if fitted is not None:
                return accept_by_score(
                    fitted, "the number of matched rectangles", float(len(match.here)), self.least_matches
                )
        return no_answer()

    def _matches(self, target: FreeRectangles, source: FreeRectangles, scale: ScaleRange) -> list[Match]:
        """Return the transforms of most matches, most first."""
        found = []
        for quarter in range(4):
            turn = Similarity2(yaw=quarter * math.pi / 2.0)
            turned = _turned(source.boxes, turn)
            for there, here in zip(*self._of_one_shape(target.boxes, turned, scale), strict=True):
                size = math.sqrt(_areas(target.boxes[[there]])[0] / _areas(turned[[here]])[0])
                shift = _middles(target.boxes[[there]])[0] - size * _middles(turned[[here]])[0]
                placed = size * turned + np.tile(shift, 2)
                pairs = self._matched(target.boxes, placed)
                moved = Similarity2(float(shift[0]), float(shift[1]), 0.0, size) @ turn
                found.append(Match(moved, *pairs))
        return sorted(found, key=lambda match: -len(match.here))[: self.proposals]

    def _of_one_shape(
        self, target: Boxes, source: Boxes, scale: ScaleRange
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pair rectangles of nearly the same proportions whose sizes agree with the range of the scale."""
        ratios = _sides(target)[:, None] / _sides(source)[None, :]
        sizes = np.sqrt(ratios.prod(axis=2))
        alike = np.abs(np.log(ratios[:, :, 0] / ratios[:, :, 1])) <= self.tolerance
        possible = (sizes >= scale.low / (1.0 + self.tolerance)) & (sizes <= scale.high * (1.0 + self.tolerance))
        there, here = np.nonzero(alike & possible)
        return there, here

    def _matched(self, target: Boxes, placed: Boxes) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pair each placed rectangle with the target's that is most like it, if it is near enough."""
        off = np.abs(target[:, None, :] - placed[None, :, :]).max(axis=2)
        sides = _sides(placed).mean(axis=1)
        there = off.argmin(axis=0)
        here = np.flatnonzero(off[there, np.arange(len(placed))] <= self.tolerance * sides)
        return there[here], here

    def _fitted(
        self, target: FreeRectangles, source: FreeRectangles, match: Match, scale: ScaleRange
    ) -> Similarity2 | None:
        """Fit a transform, cells to cells, to the corners of all matched rectangles."""
        turn = Similarity2(yaw=match.target_from_source.yaw)
        corners = _corners(_turned(source.boxes[match.here], turn))
        fit = fit_similarity(_corners(target.boxes[match.there]), turn.inverse().apply(corners), scale)
        return None if fit is None else target.upright_from_map.inverse() @ fit @ source.upright_from_map


def wall_direction(points: NDArray[np.float64]) -> float:
    """Return the direction [rad] in [0, pi / 2) of most walls, to a tenth of a degree.

    Points (N, 2) vote for lines one cell apart in both directions; the sum of the squared votes is greatest where they
    lie along lines, as in the Hough spectrum of Carpin 2008.
    """
    about = points - points.mean(axis=0)
    coarse = np.arange(90.0)
    best = coarse[int(np.argmax([_in_line(about, angle) for angle in coarse.tolist()]))]
    fine = best + np.arange(-10, 11) / 10.0
    return math.radians(float(fine[int(np.argmax([_in_line(about, angle) for angle in fine.tolist()]))]) % 90.0)


def _in_line(points: NDArray[np.float64], degrees: float) -> float:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    total = 0.0
    for across in (c * points[:, 0] + s * points[:, 1], c * points[:, 1] - s * points[:, 0]):
        lines = np.floor(across).astype(np.int64)
        votes = np.bincount(lines - lines.min()).astype(np.float64)
        total += float((votes**2).sum())
    return total


def _upright(free: NDArray[np.uint8], direction: float) -> tuple[Similarity2, NDArray[np.uint8]]:
    """Turn a raster, row 0 lowest, so that a direction comes to lie along x; return the turn, cells to cells."""
    rows, cols = free.shape
    turn = Similarity2(yaw=-direction)
    corners = turn.apply(np.array([[0.0, 0.0], [cols, 0.0], [0.0, rows], [cols, rows]]))
    low, high = corners.min(axis=0), corners.max(axis=0)
    upright = Similarity2(float(-low[0]), float(-low[1])) @ turn
    half = Similarity2(0.5, 0.5)
    matrix = (half.inverse() @ upright @ half).matrix()  # OpenCV's pixel centres are at integers
    size = [math.ceil(side) for side in (high - low).tolist()]
    return upright, cv2.warpAffine(free, matrix, (size[0], size[1]), flags=cv2.INTER_NEAREST).astype(np.uint8)


@njit(cache=True)
def _maximal_rectangles(free: NDArray[np.bool_], least_side: int, most: int) -> tuple[Boxes, int]:
    """List the largest maximal rectangles of true cells, (most, 4) of which the first so many are filled.

    A stack holds the open rectangles that end in the current row, by rising height (the largest rectangle under a
    histogram); one that closes is maximal to three sides, and to the fourth if the next row does not continue it.
    """
    rows, cols = free.shape
    boxes, areas, count = np.empty((most, 4)), np.empty(most), 0
    heights = np.zeros(cols + 1, np.int64)
    starts, tops = np.empty(cols + 1, np.int64), np.empty(cols + 1, np.int64)
    below = np.zeros(cols + 1, np.int64)
    for row in range(rows):
        for col in range(cols):
            heights[col] = heights[col] + 1 if free[row, col] else 0
            continues = row + 1 < rows and free[row + 1, col]
            below[col + 1] = below[col] + (1 if continues else 0)
        depth = 0
        for col in range(cols + 1):
            start = col
            while depth > 0 and tops[depth - 1] > heights[col]:
                depth -= 1
                start, height = starts[depth], tops[depth]
                width = col - start
                if min(width, height) < least_side or below[col] - below[start] == width:
                    continue
                place, area = count, float(width * height)
                if count == most:
                    place = int(areas.argmin())
                    if areas[place] >= area:
                        continue
                else:
                    count += 1
                areas[place] = area
                boxes[place] = (start, row + 1 - height, col, row + 1)
            if heights[col] > 0 and (depth == 0 or tops[depth - 1] < heights[col]):
                starts[depth], tops[depth] = start, heights[col]
                depth += 1
    return boxes, count


def _distinct(boxes: Boxes, alike: float, most: int) -> Boxes:
    """Keep the first rectangles, but those whose intersection over union with a kept one is large."""
    kept: list[int] = []
    for k in range(len(boxes)):
        if len(kept) == most:
            break
        others = boxes[kept]
        low, high = np.maximum(others[:, :2], boxes[k, :2]), np.minimum(others[:, 2:], boxes[k, 2:])
        common = np.clip(high - low, 0.0, None).prod(axis=1)
        if not (common >= alike * (_areas(others) + _areas(boxes[[k]]) - common)).any():
            kept.append(k)
    return boxes[kept]


def _sides(boxes: Boxes) -> NDArray[np.float64]:
    return boxes[:, 2:] - boxes[:, :2]


def _areas(boxes: Boxes) -> NDArray[np.float64]:
    return np.asarray(_sides(boxes).prod(axis=1), np.float64)


def _middles(boxes: Boxes) -> NDArray[np.float64]:
    return (boxes[:, :2] + boxes[:, 2:]) / 2.0


def _turned(boxes: Boxes, turn: Similarity2) -> Boxes:
    """Turn rectangles by quarters about the origin."""
    ends = np.stack((turn.apply(boxes[:, :2]), turn.apply(boxes[:, 2:])))
    return np.hstack((ends.min(axis=0), ends.max(axis=0)))


def _corners(boxes: Boxes) -> NDArray[np.float64]:
    """Return the corners (4 N, 2) of rectangles."""
    columns = ((0, 1), (2, 1), (2, 3), (0, 3))
    return np.concatenate([boxes[:, list(corner)] for corner in columns])
