"""Find text in drawn plans, so that the names of rooms do not become solids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mapping.wording import counted


@dataclass(frozen=True)
class TextSettings:
    """Set up the search for text: rows of small solids that touch nothing.

    - ``largest`` [m]: longer side of a letter;
    - ``least`` [cells]: height of a letter that can be read;
    - ``gap`` [of the letters' height]: between two neighbours, a space between words included. Pillars in a row stand
      farther apart;
    - ``likeness``: ratio of the heights of two neighbours; small letters beside capitals;
    - ``greatest_fill``: share of its bounding box that a letter fills, unless it is a bar as in I; a disc fills 0.79;
    - ``least_open``: share of the solids in a row that fill so little.
    """

    largest: float = 1.5
    least: int = 5
    gap: float = 0.9
    likeness: float = 2.0
    greatest_fill: float = 0.72
    least_open: float = 0.5


def without_text(free: NDArray[np.bool_], resolution: float) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Free the cells (rows, cols) of text, and say how many letters there were."""
    labels, letters = find_text(free, resolution)
    if not letters.size:
        return free, ()
    kept: NDArray[np.bool_] = free | np.isin(labels, letters)
    return kept, (f"dropped {counted(len(letters), 'letter')} of text",)


def find_text(
    free: NDArray[np.bool_], resolution: float, settings: TextSettings = TextSettings()
) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """Label the solids of a plan (rows, cols), and list the labels of those that are letters, along rows or columns."""
    labels, count = ndimage.label(~free, structure=np.ones((3, 3), dtype=np.bool_))
    found = ndimage.find_objects(labels)
    boxes = np.array([[rows.start, rows.stop, cols.start, cols.stop] for rows, cols in found]).reshape(-1, 4)
    sides = boxes[:, 1::2] - boxes[:, ::2]
    fills = np.bincount(labels.ravel(), minlength=count + 1)[1:] / sides.prod(axis=1)
    small = np.flatnonzero(sides.max(axis=1, initial=0) * resolution <= settings.largest)
    if small.size < 2:
        return labels, np.zeros(0, np.int64)
    along_rows = _in_rows(boxes[small], fills[small], settings)
    along_columns = _in_rows(boxes[small][:, [2, 3, 0, 1]], fills[small], settings)
    return labels, small[along_rows | along_columns] + 1


def _in_rows(boxes: NDArray[np.int64], fills: NDArray[np.float64], settings: TextSettings) -> NDArray[np.bool_]:
    """Tell which solids stand in a row of text; ``boxes`` (N, 4) are low, high, left, right, ``fills`` (N,)."""
    low, high, left, right = boxes.T
    heights = high - low
    a, b = _near(boxes, settings).T
    lower, greater = np.minimum(heights[a], heights[b]), np.maximum(heights[a], heights[b])
    gap = np.maximum(left[a], left[b]) - np.minimum(right[a], right[b])
    common = np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])
    neighbours = (lower >= settings.least) & (greater <= settings.likeness * lower) & (2 * common >= lower)
    neighbours &= (gap >= 0) & (gap <= settings.gap * greater)
    a, b = a[neighbours], b[neighbours]
    count, row = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(len(boxes),) * 2), directed=False)
    members = np.bincount(row, minlength=count)
    open_share = np.bincount(row, weights=fills <= settings.greatest_fill, minlength=count) / members
    is_text = ((members >= 3) & (open_share >= settings.least_open)) | ((members == 2) & (open_share == 1.0))
    return np.asarray(is_text[row])


def _near(boxes: NDArray[np.int64], settings: TextSettings) -> NDArray[np.int64]:
    """List pairs of boxes (P, 2) whose middles are near enough for neighbours in a row."""
    low, high, left, right = boxes.T
    middles = 0.5 * np.stack([low + high, left + right], axis=1)
    reach = float(np.max(right - left + settings.gap * (high - low)))
    near = cKDTree(middles).query_pairs(np.hypot(reach, float(np.max(high - low))), output_type="ndarray")
    return np.asarray(near, np.int64).reshape(-1, 2)
