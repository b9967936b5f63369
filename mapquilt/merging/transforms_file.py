"""Transforms of merged maps, as people paste them: transforms.yaml, and its entries for the terminal."""

from __future__ import annotations

import re
from typing import Any

import yaml

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet, Unit
from mapping.wording import fixed
from merge.records.result import MergedGroup, MergeResult

_NOT_IN_A_FRAME = re.compile(r"[^A-Za-z0-9_/]+")

_HEADER = """\
# Transform of each map into the frame of its group's reference: x, y [unit: m as the reference states them, or cell if
# it states no resolution], yaw [rad].
# p_reference = matrix @ (x, y, 1); matrix = [[s cos, -s sin, x], [s sin, s cos, y], [0, 0, 1]] with s the scale.
"""


def transforms_text(maps: MapSet, result: MergeResult) -> str:
    """Write one entry per joined map: its transform, as a matrix too, and a command that publishes it to tf if the
    reference is in metres.

    tf has no scale. If the scale is not 1, ``publish_with`` holds the resolution and origin to serve the map with, so
    that its metres are those of the reference.
    """
    groups = [_group(maps, group) for group in result.groups if len(group.reference_from_map) > 1]
    return _HEADER + yaml.safe_dump(
        {"groups": groups}, sort_keys=False, allow_unicode=True, width=1000, default_flow_style=None
    )


def pasted_transforms(maps: MapSet, result: MergeResult) -> tuple[str, ...]:
    """Write for each joined map its transform as YAML, as a matrix and as the command that publishes it to tf."""
    return tuple(
        _pasted(maps, group.reference, name, place)
        for group in result.groups
        for name, place in group.reference_from_map.items()
        if name != group.reference
    )


def _pasted(maps: MapSet, reference: str, name: str, place: Similarity2) -> str:
    unit = _unit(maps, reference)
    rows = (", ".join(fixed(value, 5) for value in row) for row in place.matrix())
    lines = [
        f"# {reference} from {name}: x, y [{'cells' if unit == 'cell' else unit}], yaw [rad], scale",
        f"{{x: {fixed(place.x, 6)}, y: {fixed(place.y, 6)}, yaw: {fixed(place.yaw, 9)}, scale: {place.scale:.6f}}}",
        f"[{', '.join(f'[{row}]' for row in rows)}, [0, 0, 1]]",
    ]
    if unit == "m" and _is_scaled(place):
        resolution = maps.grids[maps.names.index(name)].frame.resolution * place.scale
        lines.append(f"# tf has no scale: publish {name} at {resolution:.6g} m per cell, see transforms.yaml")
    return "\n".join([*lines, _publisher(reference, name, place)] if unit == "m" else lines)


def _group(maps: MapSet, group: MergedGroup) -> dict[str, Any]:
    return {
        "reference": group.reference,
        "unit": _unit(maps, group.reference),
        "maps": [_entry(maps, group.reference, name, place) for name, place in group.reference_from_map.items()],
    }


def _entry(maps: MapSet, reference: str, name: str, place: Similarity2) -> dict[str, Any]:
    frame = maps.grids[maps.names.index(name)].frame
    entry: dict[str, Any] = {"name": name, "x": place.x, "y": place.y, "yaw": place.yaw, "scale": place.scale}
    entry["matrix"] = [*place.matrix().tolist(), [0.0, 0.0, 1.0]]
    if _is_scaled(place) and _unit(maps, reference) == "m":
        origin = frame.origin
        entry["publish_with"] = {
            "resolution": frame.resolution * place.scale,
            "origin": [origin.x * place.scale, origin.y * place.scale, origin.yaw],
        }
    if name != reference and _unit(maps, reference) == "m":
        entry["static_transform_publisher"] = _publisher(reference, name, place)
    return entry


def _unit(maps: MapSet, name: str) -> Unit:
    return maps.units[maps.names.index(name)]


def _is_scaled(place: Similarity2) -> bool:
    return abs(place.scale - 1.0) > 1e-9


def _publisher(reference: str, name: str, place: Similarity2) -> str:
    """Write the command of ROS 2 that publishes a map's transform, without its scale, to tf."""
    return (
        f"ros2 run tf2_ros static_transform_publisher --x {fixed(place.x, 6)} --y {fixed(place.y, 6)} --z 0 "
        f"--yaw {fixed(place.yaw, 9)} --pitch 0 --roll 0 --frame-id {_frame(reference)} --child-frame-id {_frame(name)}"
    )


def _frame(name: str) -> str:
    """Name a map's tf frame as in the bag of `mapquilt convert --to rosbag`; tf2 refuses a slash in front."""
    return f"{_NOT_IN_A_FRAME.sub('_', name).strip('/')}/map"
