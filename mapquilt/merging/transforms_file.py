"""transforms.yaml: the transform of each map, to publish in ROS."""

from __future__ import annotations

import re
from typing import Any

import yaml

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.records.result import MergedGroup, MergeResult

_NOT_IN_A_FRAME = re.compile(r"[^A-Za-z0-9_/]+")


def transforms_text(maps: MapSet, result: MergeResult) -> str:
    """Write one entry per joined map: its transform, and a command that publishes it to tf.

    tf has no scale. If the scale is not 1, ``publish_with`` holds the resolution and origin to serve the map with, so
    that its metres are those of the reference.
    """
    groups = [_group(maps, group) for group in result.groups if len(group.reference_from_map) > 1]
    return yaml.safe_dump({"groups": groups}, sort_keys=False, allow_unicode=True, width=1000)


def _group(maps: MapSet, group: MergedGroup) -> dict[str, Any]:
    return {
        "reference": group.reference,
        "maps": [_entry(maps, group.reference, name, place) for name, place in group.reference_from_map.items()],
    }


def _entry(maps: MapSet, reference: str, name: str, place: Similarity2) -> dict[str, Any]:
    frame = maps.grids[maps.names.index(name)].frame
    entry: dict[str, Any] = {"name": name, "x": place.x, "y": place.y, "yaw": place.yaw, "scale": place.scale}
    if abs(place.scale - 1.0) > 1e-9:
        origin = frame.origin
        entry["publish_with"] = {
            "resolution": frame.resolution * place.scale,
            "origin": [origin.x * place.scale, origin.y * place.scale, origin.yaw],
        }
    if name != reference:
        entry["static_transform_publisher"] = (
            f"ros2 run tf2_ros static_transform_publisher --x {place.x:.6f} --y {place.y:.6f} --z 0 "
            f"--yaw {place.yaw:.9f} --pitch 0 --roll 0 --frame-id {_frame(reference)} --child-frame-id {_frame(name)}"
        )
    return entry


def _frame(name: str) -> str:
    """Name a map's tf frame as in the bag of `mapquilt convert --to rosbag`."""
    return f"{_NOT_IN_A_FRAME.sub('_', name)}/map"
