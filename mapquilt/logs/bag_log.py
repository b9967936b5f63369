"""Reading the log of one robot from a ROS bag: ROS 1, or ROS 2 with MCAP or SQLite. Needs the extra ``[ros]``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from apsw import Error as SqliteError
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Connection
from rosbags.rosbag1 import ReaderError as Ros1Error
from rosbags.rosbag2 import ReaderError as Ros2Error
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore

from mapping.io.safe_load import reading
from mapping.robot.recorded_log import RateLimit, RecordedLog, covered_scans, usable_scans
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from mapquilt.logs.bag_frames import Mounting, PoseSeries, ancestors, mounting, moving_frame

LASER_SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
STATIC_TOPIC = "/tf_static"

_SURVEYED = 5000  # messages of tf in which every frame above the lidar shows up: 50 s at 100 Hz
_BAG_ERRORS = (AnyReaderError, Ros1Error, Ros2Error, SerdeError, TypesysError, SqliteError)
"""Base classes of the errors of the library rosbags."""


@dataclass
class _Content:
    """The messages of a log, reduced to what a map needs."""

    scans: list[LidarScan] = field(default_factory=list)
    transforms: dict[str, PoseSeries] = field(default_factory=dict)
    odometry: PoseSeries = field(default_factory=PoseSeries)
    base: str = ""


def load_bag(
    path: Path,
    scan_topic: str | None = None,
    odom_topic: str | None = None,
    max_rate: float = 10.0,
    on_progress: Callable[[int, int], None] | None = None,
) -> RecordedLog:
    """Read scans and odometry from a bag, message by message; scans beyond ``max_rate`` [Hz] are not kept.

    ``path`` is a .bag, .mcap or .db3 file, or the folder of a ROS 2 bag. Topics need to be named only if there are
    several. Stamps are those of the headers.

    - Odometry: the first transform above the lidar's frame that changes, which is odom -> base_link; or the
      nav_msgs/Odometry topic, if it is named or nothing in tf moves. A bag without either has no odometry.
    - Mounting: the constant transforms between base and lidar. A lidar that hangs upside down has its beams
      reversed.

    ``on_progress`` gets the number of messages read and their total. Raises ``ValueError`` naming the bag, and the
    topics where one must be chosen; ``OSError`` if a file cannot be read.
    """
    with naming(path), AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        scans = _topic(reader, LASER_SCAN, scan_topic, "--scan-topic")
        if scans is None:
            raise ValueError(f"no topic of sensor_msgs/LaserScan, only {_listed(reader.connections)}")
        several = len(_of_type(reader, ODOMETRY)) > 1 and odom_topic is None
        odometry = None if several else _topic(reader, ODOMETRY, odom_topic, "--odom-topic")
        chain = _chain_above_lidar(reader, scans)
        content = _read(reader, scans, odometry, chain, RateLimit(max_rate), on_progress)
        if not content.scans:
            raise ValueError(f"topic {scans[0].topic} has no scan")
        moving = None if odom_topic else moving_frame(chain, content.transforms)
        if moving is None and several:
            _topic(reader, ODOMETRY, None, "--odom-topic")
    return _recorded(path, content, chain, moving)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Name the bag in what its library raises in this block, as ``ValueError`` or ``OSError``."""
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file or folder")
    try:
        with reading(path, *_BAG_ERRORS):
            yield
    except MemoryError:  # rosbags reserves what a length in the file says, before it reads
        raise ValueError(f"{path}: damaged, or needs more memory than there is") from None


def _of_type(reader: AnyReader, kind: str) -> dict[str, list[Connection]]:
    """Return the connections of each topic of a type."""
    topics: dict[str, list[Connection]] = {}
    for connection in reader.connections:
        if connection.msgtype == kind:
            topics.setdefault(connection.topic, []).append(connection)
    return topics


def _topic(reader: AnyReader, kind: str, name: str | None, option: str) -> list[Connection] | None:
    """Return the connections of the topic of that name, or of the only one of its type; None if there is none."""
    topics = _of_type(reader, kind)
    if name is not None:
        if name in topics:
            return topics[name]
        found = [connection for connection in reader.connections if connection.topic == name]
        what = f"of type {found[0].msgtype}" if found else "not in the bag"
        raise ValueError(f"{option} {name} is {what}, must be {_kind(kind)}: {', '.join(sorted(topics)) or 'none'}")
    if len(topics) > 1:
        raise ValueError(
            f"{len(topics)} topics of {_kind(kind)}; `mapquilt map {option}` takes one of {', '.join(sorted(topics))}"
        )
    return next(iter(topics.values()), None)


def _kind(kind: str) -> str:
    return kind.replace("/msg/", "/")


def _listed(connections: Sequence[Connection]) -> str:
    topics = sorted({f"{each.topic} ({_kind(each.msgtype)})" for each in connections})
    return ", ".join(topics[:8]) + (", ..." if len(topics) > 8 else "") if topics else "none at all"


def _is_transform(connection: Connection) -> bool:
    return connection.msgtype in TRANSFORMS


def _chain_above_lidar(reader: AnyReader, scans: Sequence[Connection]) -> tuple[str, ...]:
    """Return the frame of the scans and the frames above it."""
    first = next(iter(_messages(reader, scans)), None)
    if first is None:
        return ()
    parent_of: dict[str, str] = {}
    transforms = [each for each in reader.connections if _is_transform(each)]
    for static in (True, False):
        chosen = [each for each in transforms if (each.topic == STATIC_TOPIC) is static]
        for _, message in islice(_messages(reader, chosen), None if static else _SURVEYED):
            parent_of.update({_frame(each.child_frame_id): _frame(each.header.frame_id) for each in message.transforms})
    return ancestors(_frame(first[1].header.frame_id), parent_of)


def _messages(reader: AnyReader, connections: Sequence[Connection]) -> Iterator[tuple[int, Any]]:
    """Yield bag time [ns] and message; nothing without connections."""
    for connection, nanoseconds, data in reader.messages(connections) if connections else ():
        yield nanoseconds, reader.deserialize(data, connection.msgtype)


def _read(
    reader: AnyReader,
    scans: Sequence[Connection],
    odometry: Sequence[Connection] | None,
    chain: Sequence[str],
    limit: RateLimit,
    on_progress: Callable[[int, int], None] | None,
) -> _Content:
    content = _Content()
    chosen = [*scans, *(odometry or ()), *(each for each in reader.connections if _is_transform(each))]
    total = sum(each.msgcount for each in chosen)
    for number, (nanoseconds, message) in enumerate(_messages(reader, chosen), start=1):
        if message.__msgtype__ == LASER_SCAN:
            stamp = _stamp(message.header, nanoseconds)
            if limit.is_due(stamp):
                content.scans.append(_scan(message, stamp, number))
        elif message.__msgtype__ == ODOMETRY:
            content.base = _frame(message.child_frame_id)
            pose = message.pose.pose
            content.odometry.add(_stamp(message.header, nanoseconds), _pose(pose.position, pose.orientation))
        else:
            for each in message.transforms:
                if (child := _frame(each.child_frame_id)) in chain:
                    series = content.transforms.setdefault(child, PoseSeries())
                    place = each.transform
                    series.add(_stamp(each.header, nanoseconds), _pose(place.translation, place.rotation))
        if on_progress is not None and number % 1000 == 0:
            on_progress(number, total)
    return content


def _stamp(header: Any, nanoseconds: int) -> float:
    """Return the stamp of a header [s]; the time of the bag if the header has none."""
    stamp: float = header.stamp.sec + 1e-9 * header.stamp.nanosec
    return stamp or 1e-9 * nanoseconds


def _frame(name: str) -> str:
    return name.removeprefix("/")


def _pose(position: Any, rotation: Any) -> tuple[float, ...]:
    return position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w


def _scan(message: Any, stamp: float, number: int) -> LidarScan:
    angles, limits = (message.angle_min, message.angle_increment), (message.range_min, message.range_max)
    with reading(f"message {number}"):
        return LidarScan.of_readings(stamp, *angles, *limits, message.ranges)


def _recorded(path: Path, content: _Content, chain: Sequence[str], moving: str | None) -> RecordedLog:
    with naming(path):
        kept, warnings = usable_scans(content.scans, [f"stamp {scan.stamp:.3f} s" for scan in content.scans])
        scans = [content.scans[k] for k in kept]
        odometry, base = _odometry(content, chain, moving)
        if odometry is not None:
            inside, outside = covered_scans((scan.stamp for scan in scans), odometry)
            scans, warnings = [scans[k] for k in inside], (*warnings, *outside)
        if base is not None and base not in chain:
            warnings = (*warnings, f"no transform from {base} to {chain[0]}: the lidar counts as the base")
            mounted = Mounting()
        else:
            mounted = mounting(chain, base, content.transforms)
        scans = [_reversed(scan) for scan in scans] if mounted.upside_down else scans
        stamps = np.array([scan.stamp for scan in scans])
        poses = Trajectory(stamps, np.zeros((len(scans), 3))) if odometry is None else odometry.interpolated(stamps)
        return RecordedLog(RobotLog(tuple(scans), poses, mounted.base_from_lidar), None, odometry is not None, warnings)


def _odometry(content: _Content, chain: Sequence[str], moving: str | None) -> tuple[Trajectory | None, str | None]:
    """Return the odometry, and the frame whose poses it gives."""
    if moving is not None:
        return content.transforms[moving].trajectory(), moving
    if len(content.odometry.stamps) > 1:
        return content.odometry.trajectory(), content.base
    return None, None


def _reversed(scan: LidarScan) -> LidarScan:
    """Return the scan of a lidar upside down as if it stood upright."""
    last = scan.angle_min + scan.angle_increment * (scan.ranges.size - 1)
    limits = scan.range_min, scan.range_max
    return LidarScan(scan.stamp, -last, scan.angle_increment, *limits, scan.ranges[::-1])
