"""Read floor plans of HouseExpo (Li et al. 2019, arXiv:1903.09845): one JSON file a house."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from worlds.importing.solids import as_solid, world_from_solids
from worlds.polygon import Polygon, edges
from worlds.world import World

THICKNESS = 0.05
"""Thickness of the walls outside the free floor [m]. A thicker one could reach across the thin walls between rooms."""


def is_houseexpo(record: Any) -> bool:
    """Check if a JSON value is a plan of HouseExpo: it lists its corners as ``verts``."""
    return isinstance(record, dict) and "verts" in record and "schema" not in record


def houseexpo_world(name: str, record: Mapping[str, Any]) -> World:
    """Build the world of a HouseExpo plan: the inside of the polygon ``verts`` [m] is free, all else solid.

    The categories of the rooms are not used. Raises ``ValueError`` if ``verts`` is no simple polygon.
    """
    try:
        points = np.array(record["verts"], dtype=np.float64).reshape(-1, 2)
    except (TypeError, ValueError):
        raise ValueError("verts must be a list of x, y pairs in metres") from None
    floor = as_solid(points)
    if floor is None:
        raise ValueError("verts is no polygon of at least three corners that does not cross itself")
    return world_from_solids(name, _outer_walls(floor))


def _outer_walls(floor: Polygon) -> list[Polygon]:
    """Return boxes outside each edge of a counter-clockwise floor, lengthened at its convex corners."""
    along = np.diff(edges(floor), axis=1)[:, 0]
    along /= np.hypot(*along.T)[:, None]
    before = np.roll(along, 1, axis=0)
    convex = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0] > 0.0
    outward = THICKNESS * np.stack((along[:, 1], -along[:, 0]), axis=-1)
    first = floor - THICKNESS * along * convex[:, None]
    last = np.roll(floor, -1, axis=0) + THICKNESS * along * np.roll(convex, -1)[:, None]
    return list(np.stack((first, first + outward, last + outward, last), axis=1))
