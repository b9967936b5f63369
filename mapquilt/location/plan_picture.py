"""Pictures of drawn floor plans, prepared for matching."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.io.picture import read_picture
from mapping.io.safe_load import reading
from mapquilt.merging.map_names import map_names
from worlds.importing.drawn_walls import DrawnWalls, find_walls
from worlds.importing.plan_file import PICTURES

LARGEST_DIAGONAL = 4000.0
"""Diagonal of a picture [pixels] above which walls are searched on a smaller copy; lines are wide enough there."""


@dataclass(frozen=True, eq=False)
class PlanPicture:
    """Hold a plan: its ``name``, its ``grey`` picture (H, W), top row first, and its ``walls``, of which a pixel is
    ``shrunk`` pixels of the picture wide. Both have the same lower left corner."""

    name: str
    path: Path
    grey: NDArray[np.uint8]
    walls: DrawnWalls
    shrunk: int = 1

    @property
    def building(self) -> tuple[int, int, int, int]:
        """Left, right, lower and upper border of the building [pixels of the picture from its lower left corner]."""
        rows, cols = np.nonzero(self.walls.inside[::-1])
        borders = (cols.min(), cols.max() + 1, rows.min(), rows.max() + 1)
        left, right, low, high = (self.shrunk * int(each) for each in borders)
        return left, right, low, high

    @property
    def diagonal(self) -> float:
        """Diagonal of the building [pixels of the picture]."""
        left, right, low, high = self.building
        return math.hypot(right - left, high - low)


def read_plans(
    paths: Sequence[Path], on_progress: Callable[[int, int], None] = lambda done, total: None
) -> tuple[PlanPicture, ...]:
    """Read pictures of plans and find their walls.

    Raises ``ValueError`` or ``OSError`` naming the file that is no picture, is given twice, or shows no walls.
    """
    for index, path in enumerate(paths):
        if path.is_dir():
            raise ValueError(f"{path}: is a folder; name the pictures in it, such as {path}/*.png")
        if path.suffix.lower() not in PICTURES:
            raise ValueError(f"{path}: is no picture of a plan, must end in one of {', '.join(PICTURES)}")
        if path in paths[:index]:
            raise ValueError(f"{path}: is given twice")
    plans: list[PlanPicture] = []
    for name, path in zip(map_names(paths), paths, strict=True):
        on_progress(len(plans), len(paths))
        plans.append(_read_plan(name, path))
    return tuple(plans)


def _read_plan(name: str, path: Path) -> PlanPicture:
    picture = read_picture(path)
    grey = picture.grey if picture.opaque is None else np.where(picture.opaque, picture.grey, np.uint8(255))
    shrunk = max(1, math.ceil(math.hypot(*grey.shape) / LARGEST_DIAGONAL))
    with reading(path):
        return PlanPicture(name, path, grey, find_walls(_shrunk(grey, shrunk)), shrunk)


def _shrunk(grey: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """Average blocks of ``factor`` x ``factor`` pixels, from the lower left corner."""
    if factor == 1:
        return grey
    rows, cols = (-size % factor for size in grey.shape)
    whole = np.pad(grey, ((rows, 0), (0, cols)), mode="edge")
    size = (whole.shape[1] // factor, whole.shape[0] // factor)
    return np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), np.uint8)
