"""Convert worlds to and from records for JSON and YAML."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mapping.geometry.se2 import SE2
from worlds.polygon import Polygon, disc, signed_area, turned_box
from worlds.world import World

SCHEMA = "mapquilt-world/1"
CYLINDER_CORNERS = 48
"""Number of corners of a cylinder's polygon; at 1 m radius it is less than 3 mm too small."""


def world_to_json(world: World) -> dict[str, Any]:
    """Convert a world to a record for ``json.dumps``; numbers are preserved bit for bit."""
    record: dict[str, Any] = {
        "schema": SCHEMA,
        "name": world.name,
        "seed": world.seed,
        "size": list(world.size),
        "polygons": [polygon.tolist() for polygon in world.obstacles],
    }
    if world.starts:
        record["starts"] = [{"x": start.x, "y": start.y, "yaw": start.yaw} for start in world.starts]
    if world.fence is not None:
        record["fence"] = world.fence.tolist()
    if world.parts != 1:
        record["parts"] = world.parts
    return record


def world_from_json(record: Mapping[str, Any], name: str | None = None) -> World:
    """Build a world from a record of ``world_to_json``, or from one written by hand with boxes and cylinders.

    Polygons may run in either direction. A record without a name gets ``name``. Raises ``ValueError`` with the field
    that is missing, unknown or malformed.
    """
    if record.get("schema") != SCHEMA:
        raise ValueError(f"world: schema is {record.get('schema')!r}, must be {SCHEMA!r}")
    name = record.get("name", name)
    for field, value in (("name", name), ("size", record.get("size"))):
        if value is None:
            raise ValueError(f"world: {field} is missing")
    try:
        width, height = (float(each) for each in record["size"])
        fence = record.get("fence")
        return World(
            str(name),
            int(record.get("seed", 0)),
            (width, height),
            tuple(_obstacles(record)),
            tuple(_start(index, each) for index, each in enumerate(record.get("starts", ()))),
            None if fence is None else _polygon("fence", fence),
            int(record.get("parts", 1)),
        )
    except KeyError as error:
        raise ValueError(f"world: {error.args[0]} is missing") from error
    except (TypeError, OverflowError) as error:
        raise ValueError(f"world: {error}") from error


def _obstacles(record: Mapping[str, Any]) -> list[Polygon]:
    polygons = [_polygon(f"polygons[{index}]", each) for index, each in enumerate(record.get("polygons", ()))]
    for index, each in enumerate(record.get("boxes", ())):
        x, y, length, width, yaw = _numbers(f"boxes[{index}]", [*each["centre"], *each["size"], each.get("yaw", 0.0)])
        _require_positive(f"boxes[{index}].size", min(length, width))
        polygons.append(turned_box(x, y, length, width, yaw))
    for index, each in enumerate(record.get("cylinders", ())):
        x, y, radius = _numbers(f"cylinders[{index}]", [*each["centre"], each["radius"]])
        _require_positive(f"cylinders[{index}].radius", radius)
        polygons.append(disc(x, y, radius, CYLINDER_CORNERS))
    return polygons


def _polygon(where: str, corners: Any) -> Polygon:
    try:
        polygon = np.array(corners, dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"world: {where} is no list of x, y pairs: {error}") from None
    if polygon.ndim != 2 or polygon.shape[1] != 2 or len(polygon) < 3:
        raise ValueError(f"world: {where} has shape {polygon.shape}, needs (N, 2) with at least three corners")
    return polygon[::-1] if signed_area(polygon) < 0.0 else polygon


def _start(index: int, record: Mapping[str, Any]) -> SE2:
    return SE2(*_numbers(f"starts[{index}]", [record["x"], record["y"], record.get("yaw", 0.0)]))


def _numbers(where: str, values: list[Any]) -> list[float]:
    numbers = [float(value) for value in values]
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"world: {where} holds a number that is not finite")
    return numbers


def _require_positive(where: str, value: float) -> None:
    if value <= 0.0:
        raise ValueError(f"world: {where} is {value:g}, must be positive")
