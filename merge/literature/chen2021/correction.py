"""Chapter 5 step by step, with the picture of each step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from merge.literature.chen2021.binarisation import Image, binarised
from merge.literature.chen2021.closing import closed, closing_side
from merge.literature.chen2021.corners import corners
from merge.literature.chen2021.interest_points import Points, dilated, interest_points, tile_half
from merge.literature.chen2021.main_direction import MainDirection, main_direction
from merge.literature.chen2021.main_structure import main_structure
from merge.literature.chen2021.straightening import Straightened, straightened
from merge.literature.chen2021.wall_thickness import WallThickness, wall_thickness


@dataclass(frozen=True, eq=False)
class Correction:
    """Pictures and sizes of the steps of a correction. All pictures after ``straightened`` have its size.

    ``half`` is L: tiles are 2L + 1 pixels wide; ``closing`` is the side of the closing. ``corners`` (N, 2) u, v are the
    keypoints on the corrected picture ``structure``.
    """

    picture: Image
    walls: Image
    direction: MainDirection
    straightened: Straightened
    thickness: WallThickness
    closing: int
    closed: Image
    half: int
    points: Points
    structure: Image
    corners: NDArray[np.float64]

    @property
    def note(self) -> str | None:
        """Describe a deviation from the thesis; None if there is none."""
        if self.direction.clear:
            return None
        return f"no main direction (sharpness {self.direction.sharpness:.2f}): not turned, links are drawn as they run"


def corrected(picture: Image) -> Correction:
    """Correct the grey picture (rows, cols) of a map, highest row first, whose walls are dark.

    Source: Chen 2021, sections 5.1 to 5.5. His manual parameters follow from the thickness of the walls. A picture
    without a main direction is not rotated.
    """
    walls = binarised(picture)
    direction = main_direction(walls)
    turned = straightened(walls, direction.angle if direction.clear else 0.0)
    thickness = wall_thickness(turned.walls)
    closing, half = closing_side(thickness.usual), tile_half(thickness.thick)
    mended = closed(turned.walls, closing)
    points = interest_points(mended, half)
    structure = main_structure(dilated(mended, half), points, half, direction.clear)
    found = corners(structure, half)
    return Correction(picture, walls, direction, turned, thickness, closing, mended, half, points, structure, found)
