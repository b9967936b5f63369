"""Write missions to disk and read them back."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.io.atomic import write_bytes_atomically
from mapping.io.npz_file import load_npz, save_npz
from mapping.io.safe_load import read_json, reading
from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from sim.mission.mission import Mission
from sim.mission.settings import CutSettings, MissionSettings
from sim.physics.drive import DriveLimits
from sim.physics.robot import RobotSettings
from sim.policies.settings import BehaviourSettings
from sim.sensors.lidar import Lidar
from sim.sensors.lidar_presets import lidar_preset
from worlds.world import World
from worlds.world_file import world_from_json, world_to_json

SCHEMA_VERSION = 2
WORLD_FILE = "world.json"

DIMENSIONS = {"stamps": 1, "world_from_base": 2, "ranges": 2, "hits_robot": 2}
"""Arrays of a robot's file, and their numbers of dimensions."""

BEYOND = 0.1
"""Distance [m] beyond the world's border that a lidar or a hit may have: rounding, and no more."""

_FIELDS = {"schema", "version", "seed", "touches", "settings"}
_OLD_POLICIES = {"tour": "patrol"}
"""Names of policies in older files."""
TUNING = {"behaviour": BehaviourSettings(), "cut": CutSettings()}
"""Settings that ``mission.json`` holds only if they differ from these."""


def save_mission(mission: Mission, folder: Path) -> None:
    """Write ``world.json``, ``mission.json`` and one ``robot_<i>.npz`` per robot into the folder, created if missing.

    Equal missions give equal bytes. Raises ``OSError`` if the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    record = {
        "schema": "mapquilt/mission",
        "version": SCHEMA_VERSION,
        "seed": mission.seed,
        "touches": list(mission.contacts),
        "settings": _settings_record(mission.settings),
    }
    _write_json(folder / WORLD_FILE, world_to_json(mission.world))
    _write_json(folder / "mission.json", record)
    for index, truth in enumerate(mission.robots):
        arrays = {
            "stamps": truth.trajectory.stamps,
            "world_from_base": truth.trajectory.poses,
            "ranges": np.array([scan.ranges for scan in truth.scans]),
            "hits_robot": truth.hits_robot,
        }
        save_npz(folder / f"robot_{index}.npz", arrays)


def load_mission(folder: Path) -> Mission:
    """Read a mission as ``save_mission`` wrote it, bit for bit.

    Raises ``OSError`` if a file is missing, ``ValueError`` with the file if one is malformed.
    """
    world_path, path = folder / WORLD_FILE, folder / "mission.json"
    with reading(world_path):
        world = world_from_json(_read_record(world_path))
    record = _read_record(path)
    if record.get("schema") != "mapquilt/mission" or record.get("version") != SCHEMA_VERSION:
        raise ValueError(f"{path}: not a mapquilt/mission of version {SCHEMA_VERSION}")
    with reading(f"{path}: malformed"):
        _check_fields(record)
        settings = _settings(record["settings"])
        seed, contacts = _count("seed", record["seed"]), tuple(_count("touches", each) for each in record["touches"])
    robots = tuple(
        _load_robot(folder / f"robot_{k}.npz", robot.lidar, world) for k, robot in enumerate(settings.robots)
    )
    return Mission(world, robots, seed, settings, contacts)


def _check_fields(record: dict[str, Any]) -> None:
    for name in sorted(record.keys() ^ _FIELDS):
        raise ValueError(f"the field {name[:100]!r} is {'missing' if name in _FIELDS else 'unknown'}")


def _count(name: str, value: Any) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"{name} is {value!r}, must be an integer of at least 0")
    return value


def _settings_record(settings: MissionSettings) -> dict[str, Any]:
    """Return the settings without tuning that has its default: most missions have no other."""
    record = asdict(settings)
    for name, default in TUNING.items():
        if getattr(settings, name) == default:
            del record[name]
    return record


def _tuning(default: Any, record: Any) -> Any:
    """Read nested settings, of the class and fields of ``default``."""
    if isinstance(record, dict):
        return type(default)(**{name: _tuning(getattr(default, name, None), value) for name, value in record.items()})
    return tuple(record) if isinstance(record, list) else record


def _settings(record: dict[str, Any]) -> MissionSettings:
    robots = [_robot(each) for each in record["robots"]]
    policy = _OLD_POLICIES.get(record["policy"], record["policy"])
    tuning = {name: _tuning(default, record[name]) for name, default in TUNING.items() if name in record}
    return MissionSettings(**{**record, **tuning, "robots": robots, "policy": policy})


def _robot(record: dict[str, Any]) -> RobotSettings:
    lidar = Lidar(**{**record["lidar"], "base_from_lidar": SE2(**record["lidar"]["base_from_lidar"])})
    lidar_preset(lidar.model)
    start = None if record["start"] is None else SE2(**record["start"])
    return RobotSettings(**{**record, "lidar": lidar, "limits": DriveLimits(**record["limits"]), "start": start})


def _load_robot(path: Path, lidar: Lidar, world: World) -> RobotTruth:
    arrays = load_npz(path, DIMENSIONS)
    with reading(path):
        _check_arrays(arrays, lidar, world)
        trajectory = Trajectory(arrays["stamps"], arrays["world_from_base"])
        scans = tuple(
            LidarScan(float(stamp), lidar.angle_min, lidar.angle_increment, lidar.range_min, lidar.range_max, sweep)
            for stamp, sweep in zip(trajectory.stamps, arrays["ranges"], strict=True)
        )
        truth = RobotTruth(scans, trajectory, arrays["hits_robot"], lidar.base_from_lidar)
        _check_beams(truth, world)
        return truth


def _check_arrays(arrays: dict[str, NDArray[Any]], lidar: Lidar, world: World) -> None:
    for name, array in arrays.items():
        if array.dtype.kind not in "fiub":
            raise ValueError(f"{name} is of type {array.dtype}, must be numeric")
        if array.ndim != DIMENSIONS[name]:
            raise ValueError(f"{name} has shape {array.shape}, must have {DIMENSIONS[name]} dimensions")
    if arrays["ranges"].shape[1] != lidar.beams:
        raise ValueError(f"ranges has shape {arrays['ranges'].shape}, must be (N, {lidar.beams}) for this lidar")
    places = arrays["world_from_base"][..., :2]
    if not ((places >= 0.0) & (places <= world.size)).all():
        raise ValueError(f"world_from_base leaves the world of {world.size[0]:g} x {world.size[1]:g} m")


def _check_beams(truth: RobotTruth, world: World) -> None:
    """Refuse a mission whose lidar or hits lie outside its world, by more than rounding."""
    limit = np.array(world.size) + BEYOND
    for number, scan in enumerate(truth.scans):
        world_from_lidar = truth.trajectory.pose(number) @ truth.base_from_lidar
        for name, points in (("lidar", np.zeros((1, 2))), ("end of a beam", scan.points())):
            places = world_from_lidar.apply(points)
            outside = ~((places >= -BEYOND) & (places <= limit)).all(axis=1)
            if outside.any():
                x, y = places[outside][0]
                raise ValueError(
                    f"scan {number}: the {name} is at {x:.6g}, {y:.6g} m, outside the world of "
                    f"{world.size[0]:g} x {world.size[1]:g} m; the mounting in mission.json or the ranges are wrong"
                )


def _write_json(path: Path, record: dict[str, Any]) -> None:
    write_bytes_atomically(path, (json.dumps(record, indent=1, sort_keys=True) + "\n").encode())


def _read_record(path: Path) -> dict[str, Any]:
    record = read_json(path)
    if not isinstance(record, dict):
        raise ValueError(f"{path}: must hold a JSON object")
    return record
