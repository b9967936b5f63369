"""Chapter 5 step by step, with the picture of each step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.validation import require_valid
from merge.literature.chen2021.interest_points import Points, dilated, interest_points, tile_half
from merge.literature.chen2021.main_direction import DirectionSettings, MainDirection, main_direction
from merge.literature.chen2021.main_structure import StructureSettings, corners, main_structure
from merge.literature.chen2021.wall_picture import (
    Image,
    Straightened,
    WallThickness,
    binarised,
    closed,
    closing_side,
    straightened,
    wall_thickness,
)

Step = Literal["binarise", "rotate", "close", "sample", "straighten"]
"""Steps 5.1 to 5.5."""


@dataclass(frozen=True)
class CorrectionSettings:
    """Settings of the correction of a map image.

    - ``unknown_grey``: grey of unknown pixels; darker ones are walls;
    - ``margin``: pixels left around the walls of the rotated picture;
    - ``gap_cells``: side of the closing that bridges single missing cells before walls are measured;
    - ``thick_share``: quantile of the thickness of the walls that a tile covers;
    - ``direction``, ``structure``: settings of steps 5.2 and 5.5;
    - ``without``: a step to leave out, which shows what it contributes. Unbinarised, unknown pixels count as walls;
      unsampled, every pixel of the walls' centre lines is an interest point.
    """

    unknown_grey: int = 128
    margin: int = 16
    gap_cells: int = 3
    thick_share: float = 0.9
    direction: DirectionSettings = field(default_factory=DirectionSettings)
    structure: StructureSettings = field(default_factory=StructureSettings)
    without: Step | None = None

    def __post_init__(self) -> None:
        require_valid(self, shares=("thick_share",))


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
        return f"no main direction (sharpness {self.direction.sharpness:.2f}): not rotated, lines keep their directions"


def corrected(picture: Image, settings: CorrectionSettings = CorrectionSettings()) -> Correction:
    """Correct the grey picture (rows, cols) of a map, highest row first, whose walls are dark.

    Source: Chen 2021, sections 5.1 to 5.5. His manual parameters follow from the thickness of the walls. A picture
    without a main direction is not rotated.
    """
    without = settings.without
    walls = binarised(picture, settings.unknown_grey + (without == "binarise"))
    direction = main_direction(walls, settings.direction)
    if without == "rotate":
        direction = replace(direction, clear=False)
    turned = straightened(walls, direction.angle if direction.clear else 0.0, settings.margin)
    thickness = wall_thickness(turned.walls, settings.gap_cells, settings.thick_share)
    closing = 1 if without == "close" else closing_side(thickness.usual)
    half = 0 if without == "sample" else tile_half(thickness.thick)
    mended = closed(turned.walls, closing)
    points = interest_points(mended, half)
    structure = mended
    if without != "straighten":
        structure = main_structure(dilated(mended, half), points, half, direction.clear, settings.structure)
    found = corners(structure, half, settings.structure)
    return Correction(picture, walls, direction, turned, thickness, closing, mended, half, points, structure, found)
