"""Measure and change the strokes of a drawing: masks (H, W) of 0 and 1."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

Mask = NDArray[np.uint8]


def as_mask(pixels: ArrayLike) -> Mask:
    """Return 1 where pixels (H, W) are set, and 0 elsewhere."""
    return np.asarray(np.asarray(pixels) != 0, np.uint8)


def distance_to(mask: Mask) -> NDArray[np.float32]:
    """Return the distance of each pixel to the nearest set pixel [pixels]."""
    return np.asarray(cv2.distanceTransform(1 - mask, cv2.DIST_L2, 5), np.float32)


def widths(mask: Mask) -> NDArray[np.float64]:
    """Return the widths [pixels] of the strokes, one for each pixel of their middle lines."""
    depth = distance_to(1 - np.pad(mask, 1))[1:-1, 1:-1]
    return 2.0 * depth[_middle(depth)].astype(np.float64) - 1.0


def middle_lines(mask: Mask) -> Mask:
    """Return the pixels that are as deep in a stroke as any beside them."""
    return as_mask(_middle(distance_to(1 - np.pad(mask, 1))[1:-1, 1:-1]))


def _middle(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    return np.asarray((depth > 0.0) & (depth >= cv2.dilate(depth, square(3)) - 1e-3), np.bool_)


def length(mask: Mask) -> float:
    """Return half the length of all outlines, which is about the length of thin strokes [pixels]."""
    contours, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    return 0.5 * float(sum(cv2.arcLength(contour, True) for contour in contours))


def diagonal(mask: Mask) -> float:
    """Return the diagonal of the bounding box of the set pixels; 0 without any."""
    rows, cols = np.nonzero(mask)
    return math.hypot(np.ptp(rows) + 1, np.ptp(cols) + 1) if rows.size else 0.0


def opened(mask: Mask, diameter: float) -> Mask:
    """Drop strokes narrower than a disc of that ``diameter`` [pixels]."""
    return as_mask(cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc(diameter)))


def gaps_closed(distance: NDArray[np.float32], gap: float) -> Mask:
    """Close gaps of up to ``gap`` pixels in the strokes that the pixels have a ``distance`` [pixels] to."""
    stroke, far = distance == 0.0, as_mask(distance > 0.5 * gap)
    if gap < 2.0 or not far.any():
        return as_mask(stroke)
    return as_mask((distance_to(far) > 0.5 * gap) | stroke)


def enclosed(mask: Mask, gap: float) -> Mask:
    """Add the pixels that strokes enclose, openings of up to ``gap`` pixels taken as closed."""
    radius = math.ceil(0.5 * gap)
    margin = radius + 1
    around = holes_filled(as_mask(distance_to(np.pad(mask, margin)) <= radius))
    return mask | as_mask(distance_to(1 - around) > radius)[margin:-margin, margin:-margin]


def holes_filled(mask: Mask) -> Mask:
    """Set the pixels that strokes enclose."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return as_mask(cv2.drawContours(np.zeros_like(mask), contours, -1, 1, cv2.FILLED))


def rim(mask: Mask, width: int) -> Mask:
    """Return the pixels of a mask that are at most ``width`` pixels from its outline, along rows and columns."""
    inner = cv2.erode(np.pad(mask, width), square(2 * width + 1))[width:-width, width:-width]
    return as_mask((mask > 0) & (inner == 0))


def parts_reaching(mask: Mask, reach: float) -> Mask:
    """Keep the connected parts whose bounding box has at least a diagonal of ``reach`` [pixels]."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) >= reach
    kept[0] = False
    return as_mask(kept[labels])


def parts_of_area(mask: Mask, area: int) -> Mask:
    """Keep the connected parts of at least that ``area`` [pixels]."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = stats[:, cv2.CC_STAT_AREA] >= area
    kept[0] = False
    return as_mask(kept[labels])


def square(side: int) -> Mask:
    return np.ones((side, side), np.uint8)


def disc(diameter: float) -> Mask:
    size = max(1, round(diameter))
    return as_mask(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
