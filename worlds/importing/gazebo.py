"""Read worlds and models of Gazebo (SDF, sdformat.org): the boxes, cylinders and spheres that a lidar would meet."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from mapping.io.safe_load import read_limited, refuse_entities
from worlds.importing.solids import world_from_solids
from worlds.polygon import Polygon, disc
from worlds.world import World

HEIGHT = 0.2
"""Height of the plane in which lidars see [m]; solids above or below it are left out."""
CORNERS = 24
"""Corners of the polygon for a round solid."""
MAX_BYTES = 2**26
"""Most bytes of an SDF file."""

Matrix = NDArray[np.float64]
_OWN_FRAMES = ("", "world", "__model__", "__root__")


class _Shape(NamedTuple):
    element: ET.Element
    world_from_shape: Matrix


def read_sdf(path: Path) -> tuple[World, tuple[str, ...]]:
    """Read the collision shapes of all models and cut them at a lidar's height.

    Returns the world, and notes on what is not read: other shapes, and models that are included from other files.
    Planes are taken for the ground. Raises ``ValueError`` if the file is no SDF, a number is malformed or a pose is
    relative to another frame; ``OSError`` if it cannot be read.
    """
    data = read_limited(path, MAX_BYTES)
    refuse_entities(data)
    root = ET.fromstring(data)
    if root.tag != "sdf":
        raise ValueError(f"its root is <{root.tag}>, must be <sdf>")
    world = root.find("world")
    solids: list[Polygon] = []
    unread: Counter[str] = Counter()
    for shape in _shapes(root if world is None else world, np.eye(4)):
        found = _slice(shape)
        if found is None:
            unread[shape.element.tag] += shape.element.tag != "plane"
        elif len(found):
            solids.append(found)
    unread["include"] = len(list(root.iter("include")))
    notes = tuple(f"left out {count} of kind <{kind}>" for kind, count in sorted(unread.items()) if count)
    return world_from_solids(path.stem, solids), notes


def _shapes(parent: ET.Element, world_from_parent: Matrix) -> Iterator[_Shape]:
    for each in parent:
        if each.tag in ("model", "link", "collision"):
            yield from _shapes(each, world_from_parent @ _pose(each))
        elif each.tag == "geometry" and parent.tag == "collision":
            yield from (_Shape(shape, world_from_parent) for shape in each)


def _pose(element: ET.Element) -> Matrix:
    """Return the pose of an element in its parent, (4, 4): x, y, z, then roll, pitch and yaw about fixed axes."""
    pose = element.find("pose")
    if pose is None:
        return np.eye(4)
    name = f"<{element.tag} name={element.get('name')!r}>"
    frame = pose.get("relative_to") or pose.get("frame") or ""
    if frame not in _OWN_FRAMES:
        raise ValueError(f"{name} has a pose relative to {frame!r}, which is not read; state it in its parent's frame")
    numbers = _numbers(pose.text, 6, name)
    roll, pitch, yaw = np.radians(numbers[3:]) if pose.get("degrees") in ("true", "1") else numbers[3:]
    (cr, cp, cy), (sr, sp, sy) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    ]
    matrix[:3, 3] = numbers[:3]
    return matrix


def _slice(shape: _Shape) -> Polygon | None:
    """Return the polygon (N, 2) of a shape in the plane, empty if it misses it, None for a shape that is not read."""
    element, pose = shape
    if element.tag == "box":
        x, y, z = _size(element, "size", 3)
        corners = np.array([(-x, -y), (x, -y), (x, y), (-x, y)]) / 2.0
        return _prism_slice(corners, z, pose)
    if element.tag == "cylinder":
        (radius,), (length,) = _size(element, "radius", 1), _size(element, "length", 1)
        return _prism_slice(disc(0.0, 0.0, radius, CORNERS), length, pose)
    if element.tag == "sphere":
        (radius,) = _size(element, "radius", 1)
        above = HEIGHT - pose[2, 3]
        if abs(above) >= radius:
            return np.empty((0, 2))
        return disc(pose[0, 3], pose[1, 3], math.sqrt(radius**2 - above**2), CORNERS)
    return None


def _prism_slice(base: NDArray[np.float64], height: float, pose: Matrix) -> Polygon:
    """Cut a prism of a convex base (N, 2), centred in its frame, by the plane of the lidar."""
    ones = np.ones(len(base))
    low, high = (np.column_stack((base, side * height / 2.0 * ones, ones)) @ pose.T[:, :3] for side in (-1.0, 1.0))
    starts = np.concatenate((low, low, high))
    ends = np.concatenate((high, np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)))
    crossing = (starts[:, 2] <= HEIGHT) != (ends[:, 2] <= HEIGHT)
    start, end = starts[crossing], ends[crossing]
    share = (HEIGHT - start[:, 2]) / (end[:, 2] - start[:, 2])
    points = start[:, :2] + share[:, None] * (end - start)[:, :2]
    if len(points) < 3:
        return np.empty((0, 2))
    offset = points - points.mean(axis=0)
    polygon: Polygon = points[np.argsort(np.arctan2(offset[:, 1], offset[:, 0]), kind="stable")]
    return polygon


def _size(element: ET.Element, tag: str, count: int) -> list[float]:
    numbers = _numbers(element.findtext(tag), count, f"<{element.tag}><{tag}>")
    if min(numbers) <= 0.0:
        raise ValueError(f"<{element.tag}><{tag}> is {min(numbers):g}, must be positive")
    return numbers


def _numbers(text: str | None, count: int, name: str) -> list[float]:
    try:
        numbers = [float(part) for part in (text or "").split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name} is {(text or '').strip()!r}, must be {count} numbers")
    return numbers
