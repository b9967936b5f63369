"""Maps of a bag in the order of their time, as running robots sent them. Needs the extra ``[ros]``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mapquilt.live.received_map import MapMessage, MapPatch
from mapquilt.live.topics import MAP_TYPE, UPDATE_TYPE, UPDATES, TopicChoice, robot_names
from mapquilt.logs.bag_log import naming

UPDATE_DEFINITION = "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data\n"
"""Definition of ``UPDATE_TYPE``, which few bags without definitions and no type store have."""


def bag_maps(
    path: Path, choice: TopicChoice = TopicChoice(), on_progress: Callable[[int, int], None] | None = None
) -> Iterator[tuple[float, MapMessage | MapPatch]]:
    """Yield the time [s] and the content of each map of a bag, in the order of time.

    ``path`` is a .bag, .mcap or .db3 file, or the folder of a ROS 2 bag. ``on_progress`` gets the number of messages
    read and their total. Raises ``ValueError`` naming the bag and its topics if none is wanted; ``OSError`` if a file
    cannot be read.
    """
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(UPDATE_DEFINITION, UPDATE_TYPE))
    with naming(path), AnyReader([path], default_typestore=store) as reader:
        found = sorted({each.topic for each in reader.connections if each.msgtype == MAP_TYPE})
        names = robot_names(topic for topic in found if choice.takes(topic))
        missing = [topic for topic in choice.topics if topic not in found]
        if missing or not names:
            wanted = missing[0] if missing else choice.discover or f"of {MAP_TYPE}"
            raise ValueError(f"no topic {wanted}, only the maps {', '.join(found) or 'of no robot'}")
        chosen = [
            each
            for each in reader.connections
            if (each.msgtype == MAP_TYPE and each.topic in names)
            or (each.msgtype == UPDATE_TYPE and each.topic.removesuffix(UPDATES) in names)
        ]
        total = sum(each.msgcount for each in chosen)
        for number, (connection, nanoseconds, data) in enumerate(reader.messages(chosen), start=1):
            robot = names[connection.topic.removesuffix(UPDATES)]
            message = reader.deserialize(data, connection.msgtype)
            convert = map_message if connection.msgtype == MAP_TYPE else map_patch
            yield 1e-9 * nanoseconds, convert(robot, message)
            if on_progress is not None:
                on_progress(number, total)


def map_message(robot: str, message: Any) -> MapMessage:
    """Convert a nav_msgs/OccupancyGrid."""
    info, place = message.info, message.info.origin.position
    return MapMessage(
        robot=robot,
        stamp=_seconds(message.header),
        frame=message.header.frame_id.removeprefix("/"),
        resolution=float(info.resolution),
        origin=(place.x, place.y, yaw_of(info.origin.orientation)),
        width=info.width,
        height=info.height,
        cells=np.asarray(message.data, np.int8),
    )


def map_patch(robot: str, message: Any) -> MapPatch:
    """Convert a map_msgs/OccupancyGridUpdate."""
    cells = np.asarray(message.data, np.int8)
    return MapPatch(robot, _seconds(message.header), message.x, message.y, message.width, message.height, cells)


def _seconds(header: Any) -> float:
    return float(header.stamp.sec + 1e-9 * header.stamp.nanosec)


def yaw_of(rotation: Any) -> float:
    """Return the yaw [rad] of a quaternion."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
