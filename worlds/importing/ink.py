"""Find the ink of a drawn plan, without dirt, the sheet's frame and text."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worlds.importing.strokes import (
    Mask,
    as_mask,
    diagonal,
    distance_to,
    holes_filled,
    parts_of_area,
    rim,
    square,
    widths,
)
from worlds.importing.text import TextSettings, find_text


@dataclass(frozen=True)
class InkSettings:
    """Set up the search for ink.

    - ``least_contrast`` [grey levels]: what differs less from the paper is none of the drawing;
    - ``uneven_light`` [grey levels]: the paper is at most so much darker at one place than at most places;
    - ``blank_sigma`` [grey levels]: a drawing whose paper has more noise is smoothed by ``smoothing`` [pixels];
    - ``darkest``: percentile of the contrasts that is the ink's, in a clean picture, and in a noisy one, whose thin
      lines are pale;
    - ``line`` [of the ink's contrast]: from here on a pixel is ink;
    - ``faint`` [of the ink's contrast]: in a noisy picture, from here on if it touches clearer ink;
    - ``half_tone``: fills between these are ink, but not the smooth edges of lines;
    - ``dirt`` [pixels]: less ink that touches no other is none of the drawing;
    - ``frame_wider`` [pixels], ``frame_alike``: a closed line around all that is so much wider than the thin lines, as
      this share of the others is, is an outer wall;
    - ``frame_lined``: it is an outer wall, too, if another line accompanies this share of it at one distance, up to
      ``wall_share`` of the drawing's diagonal; else the frame of the sheet;
    - ``frame_content``: a frame has at most so many times the ink of its outermost line, for its title;
    - ``frames``: number of frames inside one another;
    - ``largest_letter`` [of the drawing's diagonal]: longer side of a letter.
    """

    least_contrast: float = 40.0
    uneven_light: float = 40.0
    blank_sigma: float = 3.0
    smoothing: float = 0.7
    darkest: tuple[float, float] = (95.0, 80.0)
    line: float = 0.5
    faint: float = 0.38
    half_tone: tuple[float, float] = (0.3, 0.75)
    dirt: int = 12
    frame_wider: float = 3.0
    frame_alike: float = 0.1
    frame_lined: float = 0.6
    wall_share: float = 0.04
    frame_content: float = 2.0
    frames: int = 3
    largest_letter: float = 0.04


def find_ink(grey: NDArray[np.uint8], settings: InkSettings = InkSettings()) -> Mask:
    """Find the lines and fills of a plan in a grey picture (H, W), without dirt, frames and text."""
    ink = _without_frames(parts_of_area(ink_pixels(grey, settings), settings.dirt), settings)
    labels, letters = find_text(ink == 0, 1.0, TextSettings(largest=settings.largest_letter * diagonal(ink)))
    kept = np.ones(int(labels.max()) + 1, np.bool_)
    kept[letters] = False
    return as_mask(ink & kept[labels])


def ink_pixels(grey: NDArray[np.uint8], settings: InkSettings = InkSettings()) -> Mask:
    """Find the ink in a grey picture (H, W), dark on light or light on dark, in uneven light."""
    levels = np.convolve(np.bincount(grey.ravel(), minlength=256), np.ones(5), "same")
    paper = int(np.argmax(levels))
    if paper < 128:
        grey, paper = 255 - grey, 255 - paper
    coarse = cv2.resize(grey, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    around = cv2.resize(cv2.medianBlur(coarse, 21), grey.shape[::-1], interpolation=cv2.INTER_LINEAR)
    contrast = np.maximum(around.astype(np.float32), paper - settings.uneven_light) - grey
    blank = np.abs(contrast[contrast < settings.least_contrast])
    # 1.48 times the median of the magnitudes is the standard deviation of a normal distribution.
    noisy = bool(blank.size) and 1.48 * float(np.median(blank)) > settings.blank_sigma
    if noisy:
        contrast = np.asarray(cv2.GaussianBlur(contrast, (0, 0), settings.smoothing), np.float32)
    clear = contrast[contrast > settings.least_contrast]
    if not clear.size:
        return np.zeros(grey.shape, np.uint8)
    dark = float(np.percentile(clear, settings.darkest[int(noisy)]))
    low, high = settings.half_tone
    half = as_mask((contrast > low * dark) & (contrast < high * dark))
    filled = cv2.morphologyEx(half, cv2.MORPH_OPEN, square(3))
    clear_ink = as_mask((contrast > settings.line * dark) | (filled > 0))
    return _continued(clear_ink, as_mask(contrast > settings.faint * dark) | clear_ink) if noisy else clear_ink


def _continued(clear: Mask, faint: Mask) -> Mask:
    """Keep the parts of faint ink that hold clear ink: lines that noise has broken (the hysteresis of Canny 1986)."""
    _, labels = cv2.connectedComponents(faint, connectivity=8)
    kept = np.zeros(int(labels.max()) + 1, np.bool_)
    kept[labels[clear > 0]] = True
    return as_mask(kept[labels])


def _without_frames(ink: Mask, settings: InkSettings) -> Mask:
    """Drop closed lines around everything along whose inside little is drawn, such as the sheet's frame."""
    for _ in range(settings.frames):
        count, labels, stats, _ = cv2.connectedComponentsWithStats(ink, connectivity=8)
        if count < 3:
            return ink
        boxes = stats[:, cv2.CC_STAT_WIDTH] * stats[:, cv2.CC_STAT_HEIGHT]
        line = as_mask(labels == 1 + int(np.argmax(boxes[1:])))
        rows, cols = np.nonzero(ink)
        if boxes[1:].max() < 0.98 * (np.ptp(rows) + 1) * (np.ptp(cols) + 1):
            return ink
        if not _is_frame(line, ink, settings):
            return ink
        ink = as_mask(ink & ~line)
    return ink


def _is_frame(line: Mask, ink: Mask, settings: InkSettings) -> bool:
    """Tell a frame from outer walls, which are wider than a line, or two lines at one distance, or hold inner walls."""
    width = float(np.median(widths(line)))
    edge = rim(holes_filled(line), math.ceil(width) + 1)
    around, others = line & edge, as_mask((ink > 0) & (edge == 0))
    if not others.any():
        return False
    of_others = widths(others)
    alike = float(np.mean(np.abs(of_others - width) <= 0.25 * width))
    if width > settings.frame_wider + float(np.percentile(of_others, 20.0)) and alike >= settings.frame_alike:
        return False
    reach = math.ceil(settings.wall_share * diagonal(ink))
    distances = np.rint(distance_to(others)[around > 0]).astype(np.int64)
    at_each = np.bincount(distances[distances <= reach], minlength=reach + 1)
    lined = float(np.convolve(at_each, np.ones(3 + math.ceil(width))).max()) / float(around.sum())
    return lined < settings.frame_lined and int(line.sum()) < settings.frame_content * int(around.sum())
