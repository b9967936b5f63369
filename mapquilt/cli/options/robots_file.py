"""Read a team of different robots from a YAML file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from mapping.geometry.se2 import SE2
from mapping.io.safe_load import read_yaml
from mapquilt.settings import lidar_at_rate
from sim.physics.robot import RobotSettings
from sim.sensors.lidar import Lidar

FIELDS = ("start", "lidar", "rate", "speed", "turn_rate", "acceleration", "turn_acceleration", "radius")


def load_robots(path: Path, usual: RobotSettings) -> tuple[RobotSettings, ...]:
    """Read ``robots: [{start: [x, y, yaw], lidar: lds01, rate: 5, speed: 0.4, ...}, ...]``; missing fields are as in
    ``usual``.

    Raises ``ValueError`` with file, robot, field and value; ``OSError`` if the file cannot be read.
    """
    record = read_yaml(path)
    entries = record.get("robots") if isinstance(record, dict) else None
    if not isinstance(entries, list) or not entries or set(record) != {"robots"}:
        raise ValueError(f"{path}: must hold a list `robots` of at least one, and nothing else")
    return tuple(_robot(entry, usual, f"{path}: robot {index}") for index, entry in enumerate(entries))


def _robot(entry: Any, usual: RobotSettings, place: str) -> RobotSettings:
    if entry is None:
        return usual
    if not isinstance(entry, dict) or not set(entry) <= set(FIELDS):
        raise ValueError(f"{place} is {entry!r}, allowed fields: {', '.join(FIELDS)}")
    try:
        robot = usual
        if "lidar" in entry or "rate" in entry:
            robot = replace(robot, lidar=_lidar(entry, usual))
        if "start" in entry:
            robot = replace(robot, start=_start(entry["start"]))
        if "radius" in entry:
            robot = replace(robot, radius=float(entry["radius"]))
        limits = {name: float(entry[name]) for name in FIELDS[3:7] if name in entry}
        return replace(robot, limits=replace(robot.limits, **limits))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{place}: {error}") from None


def _start(numbers: Any) -> SE2:
    if not isinstance(numbers, list) or len(numbers) not in (2, 3):
        raise ValueError(f"start is {numbers!r}, must be [x, y] or [x, y, yaw]")
    return SE2(*(float(number) for number in numbers))


def _lidar(entry: dict[str, Any], usual: RobotSettings) -> Lidar:
    rate = None if "rate" not in entry else float(entry["rate"])
    return lidar_at_rate(str(entry.get("lidar", usual.lidar.model)), rate)
