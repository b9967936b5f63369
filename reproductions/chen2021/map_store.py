"""File with the maps of one place and seed, so that every method gets the same."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from reproductions.chen2021.missions import DrawnMap


def maps_bytes(maps: Mapping[str, DrawnMap]) -> bytes:
    """Write maps as an npz file: by name the log-odds, and resolution and two poses as seven numbers."""
    arrays = {}
    for name, drawn in maps.items():
        frame, start = drawn.grid.frame, drawn.world_from_map
        arrays[f"{name}/log_odds"] = drawn.grid.log_odds
        arrays[f"{name}/frame"] = np.array(
            [frame.resolution, frame.origin.x, frame.origin.y, frame.origin.yaw, start.x, start.y, start.yaw]
        )
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()


def read_maps(path: Path) -> dict[str, DrawnMap]:
    """Read the maps of a file, in their order. Raises ``OSError`` if it cannot be read."""
    with np.load(path, allow_pickle=False) as arrays:
        names = [key.removesuffix("/frame") for key in arrays.files if key.endswith("/frame")]
        return {name: _map(arrays[f"{name}/log_odds"], arrays[f"{name}/frame"].tolist()) for name in names}


def _map(log_odds: np.ndarray, numbers: list[float]) -> DrawnMap:
    resolution, x, y, yaw, *start = numbers
    shape = (log_odds.shape[0], log_odds.shape[1])
    return DrawnMap(OccupancyGrid(GridFrame(resolution, SE2(x, y, yaw), shape), log_odds), SE2(*start))
