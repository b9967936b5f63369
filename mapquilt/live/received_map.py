"""Maps as robots send them: checked, turned into grids, and compared with the one before."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.grid.frame import MAX_PICTURE_CELLS, GridFrame
from mapping.grid.occupancy_grid import TRINARY_LOG_ODDS, OccupancyGrid
from mapquilt.live.settings import LiveSettings


@dataclass(frozen=True, eq=False)
class MapMessage:
    """A nav_msgs/OccupancyGrid as it came, unchecked.

    ``stamp`` [s]; ``frame`` is its frame_id; ``resolution`` [m]; ``origin`` x, y [m] and yaw [rad]; ``cells`` (N,)
    int8, row 0 first: -1 unknown, else the occupancy in percent.
    """

    robot: str
    stamp: float
    frame: str
    resolution: float
    origin: tuple[float, float, float]
    width: int
    height: int
    cells: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class MapPatch:
    """A map_msgs/OccupancyGridUpdate: ``cells`` (N,) int8 replace a window of the robot's last map, whose first cell is
    column ``x`` of row ``y``."""

    robot: str
    stamp: float
    x: int
    y: int
    width: int
    height: int
    cells: NDArray[np.int8]


def patched(message: MapMessage, patch: MapPatch) -> MapMessage:
    """Return the map with a window replaced. Raises ``ValueError`` if the window does not lie in it."""
    window = f"window of {patch.width} x {patch.height} cells at {patch.x}, {patch.y}"
    right, top = patch.x + patch.width, patch.y + patch.height
    if min(patch.x, patch.y, patch.width, patch.height) < 0 or right > message.width or top > message.height:
        raise ValueError(f"{window} must lie in the map of {message.width} x {message.height} cells")
    if patch.cells.size != patch.width * patch.height:
        raise ValueError(f"{window} has {patch.cells.size} cells")
    cells = message.cells.reshape(message.height, message.width).copy()
    cells[patch.y : top, patch.x : right] = patch.cells.reshape(patch.height, patch.width)
    return replace(message, stamp=patch.stamp, cells=cells.ravel())


def grid_of(message: MapMessage, settings: LiveSettings = LiveSettings()) -> OccupancyGrid:
    """Turn a message into a grid in the robot's map frame, which its origin, with any yaw, refers to.

    Raises ``ValueError`` naming what is wrong.
    """
    numbers = {
        "stamp": message.stamp,
        "resolution": message.resolution,
        **dict(zip(("origin x", "origin y", "origin yaw"), message.origin, strict=True)),
    }
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise ValueError(f"{name} is {value}, must be finite")
    if not 1e-3 <= message.resolution <= 10.0:
        raise ValueError(f"resolution is {message.resolution:g}, must lie between 0.001 and 10 m")
    if min(message.width, message.height) < 1:
        raise ValueError(f"map has {message.width} x {message.height} cells, must have at least one")
    if message.width * message.height > MAX_PICTURE_CELLS:
        raise ValueError(f"map has {message.width} x {message.height} cells, must have at most {MAX_PICTURE_CELLS}")
    if message.cells.size != message.width * message.height:
        raise ValueError(
            f"data has {message.cells.size} cells, must have {message.width} x {message.height} as the map states"
        )
    if message.cells.min() < -1 or message.cells.max() > 100:
        raise ValueError("data has a cell outside of -1 to 100")
    cells = message.cells.reshape(message.height, message.width)
    signs = (cells >= settings.occupied).astype(np.float32) - ((cells >= 0) & (cells <= settings.free))
    frame = GridFrame(message.resolution, SE2(*message.origin), cells.shape)
    return OccupancyGrid(frame, (np.float32(TRINARY_LOG_ODDS) * signs).astype(np.float32))


def kept_share(before: OccupancyGrid, now: OccupancyGrid, compared: int = LiveSettings.compared_cells) -> float:
    """Return the share of the cells that a map knew which the next map knows alike, at the same metres.

    A map that grows and shifts its raster keeps nearly all; one of a robot that has restarted keeps few. 1 if the map
    knew nothing. About ``compared`` cells are looked up.
    """
    known = np.flatnonzero(before.known)
    if known.size == 0:
        return 1.0
    chosen = known[:: max(1, known.size // compared)]
    cells = np.stack(np.unravel_index(chosen, before.frame.shape), axis=-1)
    there = now.frame.cells_from_metres(before.frame.metres_from_cells(cells))
    inside = now.frame.contains(there)
    signs = np.zeros(len(there), np.float32)
    signs[inside] = np.sign(now.log_odds[there[inside, 0], there[inside, 1]])
    return float(np.mean(signs == np.sign(before.log_odds[cells[:, 0], cells[:, 1]])))
