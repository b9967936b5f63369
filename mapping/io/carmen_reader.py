"""Reading CARMEN logs: FLASER, RLASER, ROBOTLASER1 and RAWLASER1, with ODOM, TRUEPOS and PARAM lines.

Formats: the header of CARMEN's logger (carmen.sourceforge.net, logger/logwrite.c). A message is one line and ends in
``ipc_timestamp ipc_hostname logger_timestamp``; the first of the two is the stamp.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2, wrap_angle
from mapping.io.safe_load import reading, require_file
from mapping.robot.recorded_log import RateLimit, RecordedLog, covered_scans, usable_scans
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

LASERS = ("ROBOTLASER1", "RAWLASER1", "FLASER", "RLASER")
"""Messages of a lidar, the most informative one first: the reader takes one kind."""

MAX_BYTES = 2**31
"""Maximum size of a log, unpacked: a day of a lidar."""

_GZIP_MAGIC = b"\x1f\x8b"
_LONGEST_LINE = 2**21  # bytes of a message of 100,000 readings
_TAIL = 3  # words after the numbers of a message: ipc_timestamp ipc_hostname logger_timestamp
_NO_RETURN = (
    8.18,
    50.0,
)  # [m]: error codes of the SICK LMS in millimetres begin at 8.183; of the PLS at 51.1, LMS 81.83
_CONSTANT = 0.005  # greatest difference [m, rad] of the mountings that a log with five or six digits states
_SAME = 1e-6  # greatest difference [m, rad] of two poses that a log repeats


@dataclass(frozen=True, eq=False)
class _Reading:
    """One sweep as its line tells it; poses are None where the message has none."""

    line: int
    stamp: float
    ranges: NDArray[np.float32]
    angles: tuple[float, float]  # angle_min, angle_increment
    max_range: float | None = None
    lidar: SE2 | None = None
    base: SE2 | None = None
    chained: SE2 | None = None  # odometry composed of the ODOM lines so far


@dataclass
class _Lines:
    """Content of a log, sorted by the kind of message."""

    readings: dict[str, list[_Reading]] = field(default_factory=dict)
    odometry: list[tuple[float, SE2]] = field(default_factory=list)
    true: list[tuple[float, SE2]] = field(default_factory=list)
    offset: float | None = None
    restarts: int = 0


def load_carmen(path: Path, max_rate: float = math.inf) -> RecordedLog:
    """Read a CARMEN log, compressed by gzip or not; scans beyond ``max_rate`` [Hz] are not kept.

    - Beams: ROBOTLASER1 and RAWLASER1 state their directions. FLASER and RLASER mean a half turn from -90 degrees on:
      180 beams lie 1 degree apart, 360 beams 0.5 degrees; other numbers of beams end at +90 degrees.
    - Mounting: the laser's pose relative to the robot's if the messages state both, else the parameter
      ``robot_frontlaser_offset`` (``robot_rearlaser_offset`` is not read; an RLASER looks backwards).
    - Odometry: the robot's pose of the message, or ODOM lines, interpolated at the stamps of RAWLASER1.
    - Reference: TRUEPOS; else the poses of a corrected log, which are those of its FLASER or ROBOTLASER1 lines if
      they move against the odometry. gmapping writes the odometry of such logs as ODOM lines that restart at each
      corrected pose, with an ODOM line of stamp 0; the reader composes them.
    - No return: a reading of ``maximum_range`` or more; for FLASER and RLASER 50 m or more, or 8.18 m in a log
      whose longest reading is at most 8.2 m (a SICK lidar in millimetres).
    - Stamps: scans that are no later than the one before are dropped with a warning. If most are, because the stamps
      have lost their digits, the scans are numbered one second apart instead.

    Raises ``ValueError`` naming the file, the line and the fault; ``OSError`` if the file cannot be read.
    """
    lines = _read_lines(path, max_rate)
    kind = next((name for name in LASERS if name in lines.readings), None)
    if kind is None:
        raise ValueError(f"{path}: no scan: must have lines {', '.join(LASERS)}")
    readings = lines.readings[kind]
    try:
        scans = _scans(readings)
        odometry, reference, mounting = _poses(kind, readings, lines)
        return _recorded(readings, scans, odometry, reference, mounting)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _recorded(
    readings: Sequence[_Reading],
    scans: Sequence[LidarScan],
    odometry: Trajectory | Sequence[SE2] | None,
    reference: Trajectory | Sequence[SE2] | None,
    base_from_lidar: SE2,
) -> RecordedLog:
    """Join scans and poses: poses by scan, or a trajectory of another rate."""
    warnings: list[str] = []
    kept, faults = usable_scans(scans, [f"line {reading.line}" for reading in readings])
    if len(scans) > 2 and len(kept) < len(scans) / 2 and len({scan.ranges.size for scan in scans}) == 1:
        if not all(isinstance(poses, list | None) for poses in (odometry, reference)):
            raise ValueError(f"{faults[0]}: the stamps are too coarse to find the poses of the scans")
        warnings.append(f"stamps do not increase at {len(scans) - len(kept)} of {len(scans)} scans: numbered 1 s apart")
        scans = [replace(scan, stamp=float(index)) for index, scan in enumerate(scans)]
        kept = np.arange(len(scans))
    else:
        warnings += faults
    for poses in (odometry, reference):
        if isinstance(poses, Trajectory):
            inside, faults = covered_scans((scans[k].stamp for k in kept), poses)
            kept, warnings = kept[inside], [*warnings, *faults]
    stamps = np.array([scans[k].stamp for k in kept])
    followed = _at(odometry, kept, stamps) or Trajectory(stamps, np.zeros((len(kept), 3)))
    log = RobotLog(tuple(scans[k] for k in kept), followed, base_from_lidar)
    return RecordedLog(log, _at(reference, kept, stamps), odometry is not None, tuple(warnings))


def _at(
    poses: Trajectory | Sequence[SE2] | None, kept: NDArray[np.int64], stamps: NDArray[np.float64]
) -> Trajectory | None:
    if poses is None:
        return None
    if isinstance(poses, Trajectory):
        return poses.interpolated(stamps)
    return Trajectory(stamps, np.array([(poses[k].x, poses[k].y, poses[k].yaw) for k in kept]))


def _scans(readings: Sequence[_Reading]) -> list[LidarScan]:
    longest = max(float(reading.ranges.max(initial=0.0)) for reading in readings)
    no_return = _NO_RETURN[0] if longest <= _NO_RETURN[0] + 0.02 else _NO_RETURN[1]
    scans = []
    for sweep in readings:
        limit = no_return if sweep.max_range is None else sweep.max_range
        try:
            scans.append(LidarScan.of_readings(sweep.stamp, *sweep.angles, 0.0, limit, sweep.ranges))
        except ValueError as error:
            raise ValueError(f"line {sweep.line}: {error}") from None
    return scans


def _poses(
    kind: str, readings: Sequence[_Reading], lines: _Lines
) -> tuple[Trajectory | list[SE2] | None, Trajectory | list[SE2] | None, SE2]:
    """Return odometry, reference and mounting."""
    mounting = SE2(0.0, 0.0, math.pi) if kind == "RLASER" else SE2(lines.offset or 0.0)
    true = _trajectory(lines.true)
    if kind == "RAWLASER1":
        return _trajectory(lines.odometry), true, mounting
    bases = [reading.base or SE2() for reading in readings]
    lidars = [reading.lidar or SE2() for reading in readings]
    if lines.restarts:
        chained = [reading.chained or SE2() for reading in readings]
        return chained, true if true is not None else bases, mounting
    offsets = np.array([_row(base.inverse() @ lidar) for base, lidar in zip(bases, lidars, strict=True)])
    if _is_constant(offsets):
        return bases, true, _mean_pose(offsets)
    corrected = [lidar @ mounting.inverse() for lidar in lidars]
    return bases, true if true is not None else corrected, mounting


def _is_constant(poses: NDArray[np.float64]) -> bool:
    difference = poses - poses[0]
    difference[:, 2] = np.remainder(difference[:, 2] + math.pi, math.tau) - math.pi
    return bool(np.abs(difference).max() <= _CONSTANT)


def _mean_pose(poses: NDArray[np.float64]) -> SE2:
    """Average equal poses (N, 3), to the precision of the log."""
    yaw = poses[0, 2] + np.mean(np.remainder(poses[:, 2] - poses[0, 2] + math.pi, math.tau) - math.pi)
    x, y, yaw = np.round([*poses[:, :2].mean(axis=0), yaw], 6).tolist()
    return SE2(x, y, yaw)


def _row(pose: SE2) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


def _trajectory(poses: Sequence[tuple[float, SE2]]) -> Trajectory | None:
    """Return the poses whose stamps increase, as a trajectory; None if there are not two."""
    rows: list[tuple[float, ...]] = []
    for stamp, pose in poses:
        if not rows or stamp > rows[-1][0]:
            rows.append((stamp, *_row(pose)))
    if len(rows) < 2:
        return None
    table = np.array(rows)
    return Trajectory(table[:, 0], table[:, 1:])


def _read_lines(path: Path, max_rate: float) -> _Lines:
    lines, chain = _Lines(), _OdometryChain()
    limits = {name: RateLimit(max_rate) for name in LASERS}
    last: SE2 | None = None
    for number, words in _messages(path):
        try:
            name, *rest = words
            if name == "PARAM" and rest[:1] == ["robot_frontlaser_offset"]:
                lines.offset = _numbers(rest[1:], 1)[0]
            elif name == "ODOM":
                x, y, yaw, _, _, _ = _numbers(rest, 6)
                pose, stamp = SE2(x, y, yaw), _stamp(rest, 6)
                if last is not None and stamp == 0.0 and _same(pose, last):
                    lines.restarts += 1
                    chain.restart(pose)
                else:
                    lines.odometry.append((stamp, pose))
                    chain.move(pose)
            elif name == "TRUEPOS":
                lines.true.append((_stamp(rest, 6), SE2(*_numbers(rest, 6)[:3])))
            elif name in LASERS:
                reading = replace(_reading(name, rest, number), chained=chain.pose)
                readings = lines.readings.setdefault(name, [])
                # stamps that do not increase are for the whole log to judge
                if limits[name].is_due(reading.stamp) or (readings and reading.stamp <= readings[-1].stamp):
                    readings.append(reading)
                last = reading.base or last
        except ValueError as error:
            raise ValueError(f"{path}: line {number}: {words[0]}: {error}") from None
    return lines


class _OdometryChain:
    """Compose the motions of ODOM lines, across restarts."""

    def __init__(self) -> None:
        self.pose: SE2 | None = None
        self._before: SE2 | None = None

    def move(self, pose: SE2) -> None:
        if self.pose is None or self._before is None:
            self.pose = pose
        else:
            self.pose = self.pose @ (self._before.inverse() @ pose)
        self._before = pose

    def restart(self, pose: SE2) -> None:
        self.pose = self.pose or pose
        self._before = pose


def _same(a: SE2, b: SE2) -> bool:
    return max(abs(a.x - b.x), abs(a.y - b.y), abs(wrap_angle(a.yaw - b.yaw))) <= _SAME


def _messages(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and words of each message. Raises ``ValueError`` naming the file if it cannot be unpacked."""
    require_file(path, MAX_BYTES)
    with path.open("rb") as probe:
        compressed = probe.read(2) == _GZIP_MAGIC
    with reading(f"{path}: damaged or cut off"), gzip.open(path, "rb") if compressed else path.open("rb") as file:
        number, left = 0, MAX_BYTES
        while line := file.readline(_LONGEST_LINE + 1):
            number, left = number + 1, left - len(line)
            if len(line) > _LONGEST_LINE or left < 0:
                raise ValueError(f"line {number} is too long, or the log has more than {MAX_BYTES} bytes")
            words = line.decode("latin-1").split()
            if words and not words[0].startswith("#"):
                yield number, words


def _reading(name: str, words: Sequence[str], line: int) -> _Reading:
    if name in ("FLASER", "RLASER"):
        count = _count(words, 0)
        ranges, rest = _ranges(words, 1, count), words[1 + count :]
        lidar, base = _pose(rest, 0), _pose(rest, 3)
        return _Reading(line, _stamp(rest, 6), ranges, _half_turn(count), lidar=lidar, base=base)
    _, angle_min, _, increment, max_range, _, _ = _numbers(words, 7)
    count = _count(words, 7)
    ranges, rest = _ranges(words, 8, count), words[8 + count :]
    rest = rest[1 + _count(rest, 0, least=0) :]
    reading = _Reading(line, 0.0, ranges, (angle_min, increment), max_range)
    if name == "RAWLASER1":
        return replace(reading, stamp=_stamp(rest, 0))
    return replace(reading, stamp=_stamp(rest, 11), lidar=_pose(rest, 0), base=_pose(rest, 3))


def _half_turn(beams: int) -> tuple[float, float]:
    """Return angle_min and angle_increment [rad] of the beams of an old message."""
    even = {180: math.radians(1.0), 360: math.radians(0.5)}
    return -math.pi / 2.0, even.get(beams, math.pi / max(beams - 1, 1))


def _count(words: Sequence[str], at: int, least: int = 1) -> int:
    count = _numbers(words[at:], 1)[0]
    if not (count == int(count) and least <= count <= 100_000):
        raise ValueError(f"number of readings is {words[at]}, must be a whole number from {least} on")
    return int(count)


def _ranges(words: Sequence[str], at: int, count: int) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):  # farther than single precision tells: no return
        return np.array(_numbers(words[at:], count), dtype=np.float32)


def _pose(words: Sequence[str], at: int) -> SE2:
    return SE2(*_numbers(words[at:], 3))


def _stamp(words: Sequence[str], at: int) -> float:
    if len(words) < at + _TAIL:
        raise ValueError("is cut off: must end in ipc_timestamp ipc_hostname logger_timestamp")
    stamp = _numbers(words[at:], 1)[0]
    if not math.isfinite(stamp):
        raise ValueError(f"ipc_timestamp is {words[at]}, must be finite")
    return stamp


def _numbers(words: Sequence[str], count: int) -> list[float]:
    if len(words) < count:
        raise ValueError(f"is cut off: {len(words)} of {count} numbers")
    try:
        return [float(word) for word in words[:count]]
    except ValueError:
        wrong = next(word for word in words[:count] if not _is_number(word))
        raise ValueError(f"{wrong[:40]!r} is no number") from None


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
