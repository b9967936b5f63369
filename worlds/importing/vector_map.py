"""Read vector maps of UT AMRL (``NAME.vectormap.json`` of github.com/ut-amrl/amrl_maps): a list of wall segments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from worlds.importing.solids import walls, world_from_solids
from worlds.world import World

THICKNESS = 0.1
"""Thickness of the walls, which the format states as lines [m]."""


def is_vector_map(record: Any) -> bool:
    """Check if a JSON value is a vector map: a list, not empty, of records with ``p0`` and ``p1``."""
    return isinstance(record, list) and bool(record) and isinstance(record[0], dict) and {"p0", "p1"} <= set(record[0])


def vector_map_world(name: str, record: Sequence[Any]) -> World:
    """Build the world of a vector map, whose segments run from ``p0`` to ``p1``, each with x and y [m].

    Raises ``ValueError`` with the number of a segment that is malformed.
    """
    segments = []
    for index, each in enumerate(record):
        try:
            segments.append([[float(each[end][axis]) for axis in ("x", "y")] for end in ("p0", "p1")])
        except (TypeError, KeyError, ValueError):
            raise ValueError(f"segment {index} must have p0 and p1, each with x and y in metres") from None
    return world_from_solids(name, walls(segments, THICKNESS))
