"""Find the walls of a drawn floor plan: fill them, and drop arcs, dimensions, furniture and stairs.

Nothing needs the scale of the plan: all lengths follow from the drawing itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from worlds.importing import strokes
from worlds.importing.ink import InkSettings, find_ink
from worlds.importing.strokes import Mask


@dataclass(frozen=True)
class DrawnWallSettings:
    """Set up the search for walls in a drawing.

    - ``ink``: settings of the search for ink;
    - ``smallest_side`` [pixels]: shorter side of a picture on which lines can be told from walls;
    - ``common``: the thin lines are the thinnest that make up this share of all lines, and those up to two pixels wider
      that do, too;
    - ``thicker`` [pixels]: walls are at least so much thicker than the thin lines;
    - ``widest_fill`` [of the drawing's diagonal]: largest gap between the two lines of a wall that is tried, and
      ``finer``: ratio of one gap that is tried to the one before;
    - ``network`` [of the drawing's diagonal]: walls that hang together reach at least so far;
    - ``least_share``: share of the length of all lines that the walls have at least; half, if all were walls of two
      lines;
    - ``least_held``: share of all lines that lie in walls; with less, the thin lines may be walls, too;
    - ``beyond_first``: the gap is at most so many times the thickness of the first walls that are enough, because inner
      and outer walls differ in thickness but stairs and furniture are wider yet;
    - ``beyond_line``: or so many times the width of the thin lines and a pixel, if that is more: a few solid pieces
      need no gap;
    - ``uneven`` [pixels]: the gaps of one thickness of wall differ by so much, as pixels round them;
    - ``complete``: shares of the longest network of walls with which a smaller gap is enough, inside of the building
      and along its outline;
    - ``shortest_wall`` [of the walls' thickness]: shorter pieces that touch nothing are symbols;
    - ``thickest_wall`` [of the walls' thickness]: thicker solids are stairs or shafts, of which nothing is known;
    - ``widest_opening`` [of the walls' thickness]: openings that are taken as closed to tell inside from outside, a
      window of 2.4 m in a wall of 0.15 m.
    """

    ink: InkSettings = field(default_factory=InkSettings)
    smallest_side: int = 64
    common: float = 0.02
    thicker: int = 2
    widest_fill: float = 0.025
    finer: float = 1.22
    network: float = 0.12
    least_share: float = 0.12
    least_held: float = 0.5
    beyond_first: float = 3.0
    beyond_line: float = 4.0
    uneven: int = 2
    complete: tuple[float, float] = (0.5, 0.93)
    shortest_wall: float = 7.0
    thickest_wall: float = 4.0
    widest_opening: float = 16.0


@dataclass(frozen=True, eq=False)
class DrawnWalls:
    """Hold what a drawing (H, W), top row first, says: ``wall`` and ``inside`` pixels, and the walls' median
    ``thickness`` [pixels]. What is inside and no wall is free, or if it is ``unclear``, unknown."""

    wall: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    unclear: NDArray[np.bool_]
    thickness: float


def find_walls(grey: NDArray[np.uint8], settings: DrawnWallSettings = DrawnWallSettings()) -> DrawnWalls:
    """Find the walls in a grey picture (H, W) of a floor plan, whether they are solid, hatched or two lines.

    If no lines are thicker than the thin ones, all lines are walls. Raises ``ValueError`` if the picture is too small,
    nothing is drawn, or no lines hang together as walls do.
    """
    if min(grey.shape) < settings.smallest_side:
        least = settings.smallest_side
        raise ValueError(f"the picture has {grey.shape[1]} x {grey.shape[0]} pixels, a plan needs {least} a side")
    ink = find_ink(grey, settings.ink)
    if not ink.any():
        raise ValueError("nothing is drawn in the picture")
    solid = _solid_walls(ink, settings)
    thickness = max(1.0, float(np.median(strokes.widths(solid))))
    thick = strokes.distance_to(strokes.opened(solid, settings.thickest_wall * thickness)) <= 0.5 * thickness
    unclear = solid & thick
    wall = strokes.parts_reaching(solid & ~unclear, settings.shortest_wall * thickness)
    if not wall.any():
        raise ValueError("no lines of the picture hang together as walls do; is it a floor plan?")
    inside = strokes.enclosed(wall | unclear, settings.widest_opening * thickness)
    return DrawnWalls(wall > 0, inside > 0, unclear > 0, thickness)


def _solid_walls(ink: Mask, settings: DrawnWallSettings) -> Mask:
    """Fill the walls of the ink.

    Walls hold most of the lines. If those found hold few, what seemed to be thin lines are the thinner walls of a plan
    that has hardly any thin lines.
    """
    walls = _filled(ink, _line_width(ink, settings), settings)
    held = _held(ink, walls)
    if held >= settings.least_held:
        return walls
    thinner = _filled(ink, 1, settings)
    return thinner if _held(ink, thinner) > 2.0 * held else walls


def _held(ink: Mask, walls: Mask) -> float:
    """Return the share of the lines' length that lies in walls."""
    middles = strokes.middle_lines(ink)
    return float(np.mean(walls[middles > 0])) if middles.any() else 0.0


def _filled(ink: Mask, line: int, settings: DrawnWallSettings) -> Mask:
    """Close the gaps between the lines of walls, and drop strokes about as thin as a ``line`` [pixels].

    Outer walls may be thicker, and have windows: along the outline of the building a larger gap is closed than inside,
    where it would fill stairs and furniture.
    """
    size = strokes.diagonal(ink)
    reach, distance = settings.network * size, strokes.distance_to(np.pad(ink, 1))

    def walls(gap: float) -> Mask:
        return strokes.opened(strokes.gaps_closed(distance, gap)[1:-1, 1:-1], line + settings.thicker)

    enough, widest = settings.least_share * strokes.length(ink), settings.widest_fill * size
    lengths: dict[int, float] = {}
    gap, found = 0, False
    while gap <= widest:
        lengths[gap] = strokes.length(strokes.parts_reaching(walls(gap), reach))
        if not found and lengths[gap] >= enough:
            reached = max(settings.beyond_first * (gap + 2 * line), settings.beyond_line * (line + 1))
            found, widest = True, min(widest, reached)
        gap = max(2, gap + 1, round(settings.finer * gap))
    if not found:
        return ink
    longest = max(lengths.values())
    inner, outer = (next(gap for gap in lengths if lengths[gap] >= share * longest) for share in settings.complete)
    network = strokes.parts_reaching(walls(outer), reach)
    widths = strokes.widths(network)
    common, thick = math.ceil(np.median(widths)), math.ceil(np.percentile(widths, 90.0))
    building = strokes.enclosed(network, settings.widest_opening * float(np.median(widths)))
    return walls(max(inner + settings.uneven, common)) | (strokes.rim(building, thick) & walls(max(outer, thick)))


def _line_width(ink: Mask, settings: DrawnWallSettings) -> int:
    """Return the width of the thin lines [pixels]."""
    lengths = np.bincount(np.rint(strokes.widths(ink)).astype(np.int64))
    common = np.flatnonzero(lengths >= settings.common * lengths.sum())
    return int(max(common[common <= common[0] + 2]))


LEAST_WALL = 0.4
"""Share of a cell that walls fill if it is occupied."""


def plan_grid(walls: DrawnWalls, pixel: float, cells_per_wall: float) -> OccupancyGrid:
    """Turn what a drawing says into a grid whose walls are ``cells_per_wall`` cells thick, or as thick as in the
    drawing if that is less.

    ``pixel`` is the side of a pixel in the unit of the grid's frame, whose origin is the lower left corner of the
    picture. Walls are occupied, what they enclose is free; outside, and where the drawing is unclear, is unknown.
    """
    factor = max(1, round(walls.thickness / cells_per_wall))
    wall, inside, unclear = (_shares(each, factor) for each in (walls.wall, walls.inside, walls.unclear))
    cells = np.full(wall.shape, UNKNOWN, np.int8)
    cells[inside > 0.5] = FREE
    cells[unclear > 0.5] = UNKNOWN
    cells[wall >= LEAST_WALL] = OCCUPIED
    shape = len(cells), len(cells[0])
    return OccupancyGrid.from_occupancy(GridFrame(factor * pixel, SE2.identity(), shape), cells)


def _shares(mask: NDArray[np.bool_], factor: int) -> NDArray[np.float64]:
    """Return the share of each block of ``factor`` x ``factor`` pixels that is set, row 0 lowest."""
    rows, cols = (-(-size // factor) for size in mask.shape)
    whole = np.zeros((rows * factor, cols * factor))
    whole[: mask.shape[0], : mask.shape[1]] = mask[::-1]
    return np.asarray(whole.reshape(rows, factor, cols, factor).mean(axis=(1, 3)), np.float64)
