"""Mend plans of real places, so that robots can explore them: drop specks and text, fill pockets, coarsen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.wording import counted
from worlds.floor import SMALLEST_PART
from worlds.importing.cells import MAX_BOXES, box_count, cell_boxes, enclosed_cells
from worlds.importing.text import without_text
from worlds.raster import touched_cells, true_raster
from worlds.world import World

FILLED = "filled"
"""First word of the note on filled floor."""

LEAST_FILLED = 0.05
"""Least area of closed gaps that is told [m^2]."""

_EIGHT = np.ones((3, 3), dtype=np.bool_)


@dataclass(frozen=True)
class MendingSettings:
    """Set up the mending of a plan.

    - ``radius`` [m]: of the robots that must reach all floor;
    - ``largest_speck`` [m^2]: solids up to this area that touch no other are noise of the map. Four cells of 5 cm: less
      than the legs of furniture that a lidar sees as one;
    - ``cell`` [m]: of the raster on which pockets are searched, as in the check that a world can be explored;
    - ``coarsest`` [m]: greatest cell to which a plan is coarsened; wider cells close doors.
    """

    radius: float = 0.2
    largest_speck: float = 0.01
    cell: float = 0.05
    coarsest: float = 0.25


@dataclass(frozen=True, eq=False)
class MendedCells:
    """Hold the free cells (rows, cols) after mending, their ``resolution`` [m], and a line about each change."""

    free: NDArray[np.bool_]
    resolution: float
    notes: tuple[str, ...]


def mend_cells(
    free: NDArray[np.bool_], resolution: float, settings: MendingSettings = MendingSettings(), *, drawn: bool = False
) -> MendedCells:
    """Mend the ``free`` cells (rows, cols) of a plan of ``resolution`` [m].

    Outdoor areas become solid. Specks are dropped, and so is text if a person has ``drawn`` the plan. Floor out of the
    robots' reach is filled, and if the solids still take too many boxes, cells are joined, solid if any of them was.
    Raises ``ValueError`` if no robot can stand anywhere, or if even the coarsest cells take too many boxes.
    """
    indoors = enclosed_cells(free, resolution)
    indoors, dropped = _without_specks(indoors, settings.largest_speck / resolution**2 + 1e-9)
    indoors, lettered = without_text(indoors, resolution) if drawn else (indoors, ())
    indoors, filled = _without_pockets(indoors, resolution, settings.radius)
    cells = MendedCells(indoors, resolution, (*dropped, *lettered, *filled))
    boxes = box_count(~cells.free)
    if boxes <= MAX_BOXES:
        return cells
    for factor in range(2, int(settings.coarsest / resolution + 1e-9) + 1):
        coarse = _coarsened(indoors, factor)
        coarse, _ = _without_pockets(coarse, factor * resolution, settings.radius)
        fewer = box_count(~coarse)
        if fewer <= MAX_BOXES:
            note = (
                f"joined {factor} x {factor} cells to cells of {factor * resolution:g} m: {boxes} boxes became {fewer}"
            )
            return MendedCells(coarse, factor * resolution, (*cells.notes, note))
    raise ValueError(
        f"the plan's solids take {boxes} boxes, at most {MAX_BOXES} can be simulated; cells of {settings.coarsest:g} m "
        "are not coarse enough"
    )


def fill_pockets(world: World, settings: MendingSettings = MendingSettings()) -> tuple[World, tuple[str, ...]]:
    """Add solids to a world where robots cannot get from its largest floor, and describe them in at most one line.

    Raises ``ValueError`` if no robot can stand anywhere.
    """
    free = true_raster(world, settings.cell).free
    if world.fence is not None:
        free &= touched_cells([world.fence], settings.cell, free.shape)
    kept, notes = _without_pockets(free, settings.cell, settings.radius)
    if kept.sum() == free.sum():
        return world, ()
    width, height = world.size
    boxes = [np.minimum(each, (width, height)) for each in cell_boxes(free & ~kept, settings.cell)]
    return replace(world, obstacles=(*world.obstacles, *boxes), parts=1), notes


def _without_specks(free: NDArray[np.bool_], largest: float) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Free the solids of at most ``largest`` cells that touch no other solid, not even at a corner."""
    labels, count = ndimage.label(~free, structure=_EIGHT)
    small = np.flatnonzero(np.bincount(labels.ravel(), minlength=count + 1)[1:] <= largest) + 1
    if len(small) == 0:
        return free, ()
    kept: NDArray[np.bool_] = free | np.isin(labels, small)
    return kept, (f"dropped {counted(len(small), 'solid speck')} of at most {counted(int(largest), 'cell')}",)


def _without_pockets(
    free: NDArray[np.bool_], resolution: float, radius: float
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Fill the floor from which a robot cannot get to the largest part.

    Other parts with room for a robot are filled as far as its body reaches there, but not where it reaches from the
    largest part; then all cells that are connected with the largest part no more.
    """
    standing = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * resolution > radius
    parts, count = ndimage.label(standing, structure=_EIGHT)
    if count == 0:
        raise ValueError(f"no free floor on which a robot of {radius:g} m radius could stand")
    areas = np.bincount(parts.ravel())[1:] * resolution**2
    largest = parts == int(np.argmax(areas)) + 1
    others = np.flatnonzero(areas >= SMALLEST_PART) + 1
    pockets = np.isin(parts, others) & ~largest
    filled = np.zeros(free.shape, dtype=np.bool_)
    if pockets.any():
        body, reached = (ndimage.distance_transform_edt(~place) * resolution <= radius for place in (pockets, largest))
        np.logical_and(body, ~reached, out=filled)
    connected, _ = ndimage.label(free & ~filled)
    kept: NDArray[np.bool_] = (connected > 0) & np.isin(connected, np.unique(connected[largest]))
    lost = int(free.sum() - kept.sum())
    rooms = len(others) - 1
    if rooms < 1 and lost * resolution**2 < LEAST_FILLED:
        return kept, ()
    about = f"closed gaps and {counted(rooms, 'part')} of the floor" if rooms > 0 else "closed gaps"
    return kept, (
        f"{FILLED} {about} that robots of {radius:g} m radius cannot reach: {lost * resolution**2:.1f} m^2 of "
        f"{free.sum() * resolution**2:.1f} m^2",
    )


def _coarsened(free: NDArray[np.bool_], factor: int) -> NDArray[np.bool_]:
    rows, cols = (-(-size // factor) for size in free.shape)
    whole = np.zeros((rows * factor, cols * factor), dtype=np.bool_)
    whole[: free.shape[0], : free.shape[1]] = free
    return np.asarray(whole.reshape(rows, factor, cols, factor).all(axis=(1, 3)))
