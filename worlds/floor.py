"""Find where robots can stand in a world, and which parts of the floor are connected."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.grid.frame import GridFrame
from worlds.raster import touched_cells, true_raster
from worlds.world import World

SMALLEST_PART = 1.0
"""Least area [m^2] of a separate part, in robot positions, unless it is the largest. Smaller areas are gaps between
objects, and no robot starts there."""
LARGEST = 500.0
"""Greatest width and height of a world [m]."""
CLEAR = 0.5
"""Least distance from a start to the nearest solid [m]."""

_EIGHT = np.ones((3, 3), dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class Floor:
    """Hold the robot positions of a world. ``part`` (rows, cols) numbers the connected parts, 1 for the largest and 0
    where a robot cannot stand. ``room`` (rows, cols) is the distance to the nearest solid [m]. ``areas`` [m^2] are
    those of the parts, largest first."""

    frame: GridFrame
    part: NDArray[np.int64]
    room: NDArray[np.float64]
    areas: tuple[float, ...]

    def middle(self, part: int) -> tuple[float, float]:
        """Return the point [m] of that part with the greatest clearance."""
        x, y = self.frame.metres_from_cells(np.argwhere(self.part == part)[np.argmax(self.room[self.part == part])])
        return float(x), float(y)


def find_floor(world: World, radius: float = 0.2, resolution: float = 0.05) -> Floor:
    """Find the floor of a world for a robot of ``radius`` [m], on a raster of ``resolution`` [m/cell]."""
    raster = true_raster(world, resolution)
    free = raster.free
    if world.fence is not None:
        free = free & touched_cells([world.fence], resolution, raster.frame.shape)
    room = ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] * resolution
    labels, _ = ndimage.label(room > radius, structure=_EIGHT)
    areas = np.bincount(labels.ravel())[1:] * resolution**2
    by_area = np.argsort(-areas, kind="stable")
    order = [each for each in by_area if areas[each] >= SMALLEST_PART] or list(by_area[:1])
    number = np.zeros(len(areas) + 1, dtype=np.int64)
    number[np.array(order, dtype=np.int64) + 1] = np.arange(1, len(order) + 1)
    return Floor(raster.frame, number[labels], room, tuple(float(areas[each]) for each in order))


def require_drivable(world: World, radius: float = 0.2) -> World:
    """Check that robots of ``radius`` [m] can explore a world, and return it.

    Raises ``ValueError`` with the fault and its position: a size above 500 m, no room for a robot, a number of parts
    that differs from the world's ``parts``, a gap in its border, or a start less than 0.5 m from a solid.
    """
    for name, value in zip(("width", "height"), world.size, strict=True):
        if value > LARGEST:
            raise ValueError(f"world {world.name!r}: {name} is {value:g} m, must be at most {LARGEST:g} m")
    floor = find_floor(world, radius)
    if not floor.areas:
        raise ValueError(f"world {world.name!r}: no free floor on which a robot of {radius:g} m radius could stand")
    if len(floor.areas) != world.parts:
        shown = [f"{area:.1f} m^2 about ({x:.1f}, {y:.1f})" for area, (x, y) in _largest_parts(floor)]
        more = "" if len(floor.areas) == len(shown) else f" and {len(floor.areas) - len(shown)} more"
        raise ValueError(
            f"world {world.name!r}: the free floor is in {len(floor.areas)} parts for a robot of {radius:g} m radius, "
            f"must be {world.parts}: {', '.join(shown)}{more}"
        )
    _require_closed(world, floor)
    _require_clear_starts(world)
    return world


def _largest_parts(floor: Floor) -> list[tuple[float, tuple[float, float]]]:
    return [(area, floor.middle(index + 1)) for index, area in enumerate(floor.areas[:5])]


def _require_closed(world: World, floor: Floor) -> None:
    if world.fence is not None:
        return
    pools, _ = ndimage.label(floor.room > 0.0)
    border = np.zeros(pools.shape, dtype=np.bool_)
    border[[0, -1]] = border[:, [0, -1]] = True
    leaks = np.argwhere(border & np.isin(pools, np.unique(pools[floor.part > 0])))
    if len(leaks):
        x, y = floor.frame.metres_from_cells(leaks[0])
        raise ValueError(
            f"world {world.name!r}: robots could leave its {world.size[0]:g} x {world.size[1]:g} m at "
            f"({x:.2f}, {y:.2f}); close it by walls or give it a fence"
        )


def _require_clear_starts(world: World) -> None:
    for index, start in enumerate(world.starts):
        fault = world.fault_at(start.x, start.y)
        if fault is not None:
            raise ValueError(f"start {index} at ({start.x:g}, {start.y:g}) is {fault}")
        gap = world.clearance([(start.x, start.y)])[0]
        if gap < CLEAR:
            raise ValueError(
                f"world {world.name!r}: start {index} at ({start.x:g}, {start.y:g}) stands {gap:.2f} m clear of the "
                f"nearest wall, needs {CLEAR:g} m"
            )
