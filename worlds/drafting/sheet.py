"""A sheet of paper on which a plan is drawn in metres of its world."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame

_SHIFT = 4
"""Bits of a pixel's fraction that OpenCV draws with."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_FONT_HEIGHT = 22.0
"""Height of a capital of OpenCV's font at scale 1 [pixels]."""


class Sheet:
    """A grey picture ``grey`` (H, W), top row first, and its ``frame`` in the world; drawing changes the picture."""

    def __init__(self, size: tuple[float, float], margin: float, pixels_per_metre: float, paper: int) -> None:
        """Lay a sheet ``margin`` [m] wider than a world of ``size`` [m] on each side."""
        width, height = (math.ceil((side + 2.0 * margin) * pixels_per_metre) for side in size)
        self.frame = GridFrame(1.0 / pixels_per_metre, SE2(-margin, -margin, 0.0), (height, width))
        self.grey: NDArray[np.uint8] = np.full((height, width), paper, np.uint8)

    def pixels(self, points: ArrayLike) -> NDArray[np.float64]:
        """Convert points (N, 2) [m] to pixels (N, 2) u, v; centres at integers, v down."""
        return pixels_from_metres(self.frame, points)

    def mask(self, polygons: Sequence[ArrayLike]) -> NDArray[np.bool_]:
        """Return the pixels that the polygons [m] fill."""
        filled = np.zeros(self.grey.shape, np.uint8)
        for polygon in polygons:
            cv2.fillPoly(filled, [self._fixed(polygon)], 255, shift=_SHIFT)
        return filled > 0

    def line(self, points: ArrayLike, ink: int, width: int, closed: bool = False) -> None:
        """Draw a polyline (N, 2) [m] of ``width`` [pixels]."""
        cv2.polylines(self.grey, [self._fixed(points)], closed, ink, width, cv2.LINE_AA, _SHIFT)

    def arc(self, centre: tuple[float, float], radius: float, start: float, end: float, ink: int, width: int) -> None:
        """Draw an arc of ``radius`` [m] from angle ``start`` to ``end`` [rad]."""
        angles = np.linspace(start, end, 25)
        self.line(np.add(centre, radius * np.column_stack((np.cos(angles), np.sin(angles)))), ink, width)

    def text(
        self, text: str, middle: tuple[float, float], height: float, ink: int, width: int, upright: bool = False
    ) -> None:
        """Write a text about a point [m] in letters of ``height`` [m]; ``upright`` from below to above."""
        scale = height / self.frame.resolution / _FONT_HEIGHT
        (wide, high), below = cv2.getTextSize(text, _FONT, scale, width)
        patch = np.zeros((high + below + 2 * width, wide + 2 * width), np.uint8)
        cv2.putText(patch, text, (width, high + width), _FONT, scale, 255, width, cv2.LINE_AA)
        if upright:
            patch = np.ascontiguousarray(np.rot90(patch))
        u, v = self.pixels([middle])[0] - 0.5 * np.array(patch.shape[::-1])
        row, col = round(v), round(u)
        rows, cols = self.grey.shape
        if row < 0 or col < 0 or row + patch.shape[0] > rows or col + patch.shape[1] > cols:
            return
        place = self.grey[row : row + patch.shape[0], col : col + patch.shape[1]]
        share = patch / 255.0
        place[:] = np.rint(share * ink + (1.0 - share) * place).astype(np.uint8)

    def _fixed(self, points: ArrayLike) -> NDArray[np.int32]:
        return np.asarray(np.rint(self.pixels(points) * 2**_SHIFT), np.int32)


def pixels_from_metres(frame: GridFrame, points: ArrayLike) -> NDArray[np.float64]:
    """Convert points (N, 2) [m] to pixels (N, 2) u, v of a picture with that frame; v down."""
    local = frame.origin.inverse().apply(np.asarray(points, np.float64)) / frame.resolution
    return np.column_stack((local[:, 0] - 0.5, frame.shape[0] - 0.5 - local[:, 1]))


def turned(grey: NDArray[np.uint8], frame: GridFrame, angle: float, paper: int) -> tuple[NDArray[np.uint8], GridFrame]:
    """Turn a picture counter-clockwise by ``angle`` [rad] on a sheet that holds all of it; return its new frame."""
    rows, cols = grey.shape
    c, s = abs(math.cos(angle)), abs(math.sin(angle))
    shape = math.ceil(rows * c + cols * s - 1e-6), math.ceil(rows * s + cols * c - 1e-6)
    half, new_half = (0.5 * frame.resolution * np.array(each[::-1], np.float64) for each in (frame.shape, shape))
    back = SE2(0.0, 0.0, -angle)
    corner = half - back.apply(new_half[None])[0]
    new = GridFrame(frame.resolution, frame.origin @ SE2(float(corner[0]), float(corner[1]), -angle), shape)
    new_from_old = np.linalg.solve(new.metre_from_pixel(), frame.metre_from_pixel())
    drawn = cv2.warpAffine(
        grey, new_from_old[:2], shape[::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=paper
    )
    return np.asarray(drawn, np.uint8), new
