"""Read buildings of the Open-RMF traffic editor (``NAME.building.yaml``): walls and doors of one level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worlds.importing.cells import MAX_BOXES
from worlds.importing.solids import walls, world_from_solids
from worlds.world import World

THICKNESS = 0.1
"""Thickness of walls [m], that of the editor's own Gazebo generator."""

Points = NDArray[np.float64]


def is_building(record: Any) -> bool:
    """Check if a YAML value is a building: it has ``levels``."""
    return isinstance(record, dict) and isinstance(record.get("levels"), dict)


def building_world(name: str, record: Mapping[str, Any], level: str | None = None) -> World:
    """Build the world of one level of a building; ``level`` may be None if the building has only one.

    Doors stand open: walls are cut where a door lies in them. In ``reference_image``, the default, vertices are
    pixels, y down, and the level's measurements state their size; a level without any is as large as the reference
    level, by the distances between fiducials of the same name. In ``cartesian_meters``, they are metres, y up.

    Raises ``ValueError`` with the level or field that is missing, unknown or malformed.
    """
    levels = {str(key): each for key, each in record["levels"].items()}
    names = ", ".join(levels)
    if level is None and len(levels) != 1:
        raise ValueError(f"has {len(levels)} levels: {names}; choose one by --level (level of a data set)")
    chosen = next(iter(levels)) if level is None else level
    if chosen not in levels:
        raise ValueError(f"has no level {level}, only {names}")
    system = record.get("coordinate_system", "reference_image")
    if system not in ("reference_image", "cartesian_meters"):
        raise ValueError(f"coordinate_system is {system}, must be reference_image or cartesian_meters")
    place = f"levels.{chosen}"
    vertices = _vertices(levels[chosen], place)
    if system == "reference_image":
        vertices = (
            vertices
            * (1.0, -1.0)
            * _metres_per_pixel(levels, chosen, str(record.get("reference_level_name", next(iter(levels)))))
        )
    edges, doors = (_edges(levels[chosen], kind, vertices, place) for kind in ("walls", "doors"))
    if len(edges) > MAX_BOXES or len(doors) > MAX_BOXES:
        raise ValueError(
            f"{place} has {len(edges)} walls and {len(doors)} doors, must have at most {MAX_BOXES} of each"
        )
    return world_from_solids(name, walls([part for edge in edges for part in _cut(edge, doors)], THICKNESS))


def _vertices(level: Mapping[str, Any], place: str) -> Points:
    try:
        return np.array([[float(each[0]), float(each[1])] for each in level["vertices"]]).reshape(-1, 2)
    except (TypeError, KeyError, IndexError, ValueError):
        raise ValueError(f"{place}.vertices must be a list of x, y, z and name") from None


def _edges(level: Mapping[str, Any], kind: str, vertices: Points, place: str) -> Points:
    """Return the edges of a kind, (N, 2, 2): start and end."""
    try:
        pairs = np.array([each[:2] for each in level.get(kind) or ()], dtype=np.int64).reshape(-1, 2)
    except (TypeError, ValueError):
        raise ValueError(f"{place}.{kind} must be a list of two vertex numbers and parameters") from None
    outside = pairs[(pairs < 0) | (pairs >= len(vertices))]
    if len(outside):
        raise ValueError(f"{place}.{kind} names vertex {outside[0]}, but there are {len(vertices)}")
    return vertices[pairs]


def _metres_per_pixel(levels: Mapping[str, Any], name: str, reference: str) -> float:
    own = _measured(levels[name], name)
    if own is not None:
        return own
    known = _measured(levels[reference], reference) if reference in levels and reference != name else None
    if known is None:
        raise ValueError(f"levels.{name}.measurements is empty, so that its size in metres is unknown")
    mine, theirs = (_fiducials(levels[each]) for each in (name, reference))
    common = sorted(set(mine) & set(theirs))
    ratios = [
        np.hypot(*(theirs[a] - theirs[b])) / np.hypot(*(mine[a] - mine[b]))
        for index, a in enumerate(common)
        for b in common[:index]
        if np.any(mine[a] != mine[b])
    ]
    if not ratios:
        raise ValueError(f"levels.{name} has no measurements and no two fiducials in common with level {reference}")
    return known * float(np.mean(ratios))


def _measured(level: Mapping[str, Any], name: str) -> float | None:
    """Return the mean of measured metres per pixel, None without measurements."""
    measurements = level.get("measurements") or ()
    lengths = np.hypot(
        *np.diff(_edges(level, "measurements", _vertices(level, f"levels.{name}"), name), axis=1)[:, 0].T
    )
    try:
        scales = [float(each[2]["distance"][1]) / length for each, length in zip(measurements, lengths, strict=True)]
    except (TypeError, KeyError, IndexError, ValueError, ZeroDivisionError):
        raise ValueError(f"levels.{name}.measurements must have two vertices and a distance [3, metres]") from None
    return float(np.mean(scales)) if scales else None


def _fiducials(level: Mapping[str, Any]) -> dict[str, Points]:
    return {str(each[2]): np.array(each[:2], dtype=np.float64) for each in level.get("fiducials") or ()}


def _cut(edge: Points, doors: Sequence[Points] | Points) -> list[Points]:
    """Return the parts (2, 2) of a wall that no door covers. Doors within its thickness of its line lie in it."""
    length = float(np.hypot(*(edge[1] - edge[0])))
    if length == 0.0:
        return []
    along = (edge[1] - edge[0]) / length
    normal = np.array((-along[1], along[0]))
    bounds = [0.0]
    offsets = np.reshape(doors, (-1, 2, 2)) - edge[0]
    inside = offsets[np.all(np.abs(offsets @ normal) <= THICKNESS, axis=1)]
    for first, last in sorted(map(sorted, (inside @ along).tolist())):
        # The wall ends half its thickness before the door, since its box exceeds it by that.
        bounds += [first - THICKNESS / 2.0, last + THICKNESS / 2.0]
    bounds.append(length)
    parts, reached = [], 0.0
    for start, stop in zip(bounds[::2], bounds[1::2], strict=True):
        begin, end = max(start, reached, 0.0), min(stop, length)
        if end > begin:
            parts.append(np.array((edge[0] + begin * along, edge[0] + end * along)))
        reached = max(reached, start)
    return parts
