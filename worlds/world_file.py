"""A world as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mapping.arrays import frozen_array
from worlds.world import World

SCHEMA_VERSION = 1


def world_to_json(world: World) -> dict[str, Any]:
    """What ``json.dumps`` can write; numbers come back bit for bit, as Python prints floats in full."""
    return {
        "schema": "mapquilt/world",
        "version": SCHEMA_VERSION,
        "name": world.name,
        "seed": world.seed,
        "size": list(world.size),
        "obstacles": [polygon.tolist() for polygon in world.obstacles],
    }


def world_from_json(record: Mapping[str, Any]) -> World:
    """The world of :func:`world_to_json`. Raises ``ValueError`` naming what is missing, foreign or malformed."""
    if record.get("schema") != "mapquilt/world":
        raise ValueError(f"world: schema is {record.get('schema')!r}, must be 'mapquilt/world'")
    if record.get("version") != SCHEMA_VERSION:
        raise ValueError(f"world: version is {record.get('version')!r}, this program reads {SCHEMA_VERSION}")
    for name in ("name", "seed", "size", "obstacles"):
        if name not in record:
            raise ValueError(f"world: {name} is missing")
    try:
        width, height = (float(each) for each in record["size"])
        polygons = tuple(frozen_array(polygon, float) for polygon in record["obstacles"])
        return World(str(record["name"]), int(record["seed"]), (width, height), polygons)
    except TypeError as error:
        raise ValueError(f"world: {error}") from error
