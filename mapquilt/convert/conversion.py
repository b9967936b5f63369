"""Conversion of runs and logs to the formats of other programs, and of map files to one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from mapping.io.carmen import save_carmen
from mapping.io.map_file import UnknownGrey
from mapping.io.map_yaml import Mode
from mapping.io.robot_log_file import load_robot_log
from mapping.io.transaction import atomic_folder
from mapping.io.tum import save_tum
from mapping.wording import counted
from mapquilt.convert.convert_map import convert_map
from mapquilt.convert.reframing import Reframing
from mapquilt.logs.log_files import is_bag, is_log
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.runs.folder import require_run
from mapquilt.runs.robot import RunRobot, load_run_robots

Format = Literal["map", "tum", "carmen", "rosbag"]

_BY_ENDING: dict[str, Format] = {
    **{".yaml": "map", ".yml": "map", ".pgm": "map", ".png": "map"},
    **{".tum": "tum", ".carmen": "carmen", ".mcap": "rosbag"},
}


@dataclass(frozen=True)
class Conversion:
    """Hold one line on the written files, and warnings about the source, one line each."""

    summary: str
    warnings: tuple[str, ...] = ()


def convert(
    source: Path,
    out: Path,
    to: Format | None = None,
    mode: Mode | None = None,
    unknown_grey: UnknownGrey = None,
    reframing: Reframing = Reframing(),
) -> Conversion:
    """Convert ``source``, a map file, a robot's log or a run folder, to ``out``, atomically.

    A map is written in ``mode``, with ``unknown_grey`` as in ``load_map``, on the raster of ``reframing``. A log is
    written as a TUM or CARMEN file, a run as a folder of TUM or CARMEN files or as a ROS 2 bag. ``to`` defaults to the
    format that the extension of ``out`` names. An existing file is replaced, but never the source; a folder must be new
    or empty.

    Raises ``ValueError`` or ``OSError`` naming the file that cannot be read or written, ``ImportError`` if the bag
    writer is not installed.
    """
    to = to or _by_ending(out)
    if to != "map" and (mode is not None or unknown_grey is not None or reframing != Reframing()):
        raise ValueError(f"--mode, --unknown, --yaw, --align-walls, --resolution and --crop are for maps, not for {to}")
    if is_log(source) and source.suffix.lower() != ".npz" and source.exists():
        kind = "ROS bag" if is_bag(source) else "CARMEN log"
        raise ValueError(f"{source}: is a {kind}; `mapquilt map {source} --out DIR` writes its map and trajectory.tum")
    if source.is_dir():
        return _convert_run(require_run(source), out, to)
    if not source.exists():
        raise ValueError(f"{source}: no such file or folder")
    if source.suffix.lower() == ".npz":
        return _convert_log(source, out, to)
    if to != "map":
        raise ValueError(f"{source}: a map cannot be converted to {to}; give a run folder or a robot's log.npz")
    return _convert_map(source, out, mode or "trinary", unknown_grey, reframing)


def _convert_map(source: Path, out: Path, mode: Mode, unknown_grey: UnknownGrey, reframing: Reframing) -> Conversion:
    made = convert_map(source, out, mode, unknown_grey, reframing)
    rows, cols = made.frame.shape
    size = f"{cols} x {rows} cells" + (f" of {made.frame.resolution:.6g} m" if made.unit == "m" else "")
    return Conversion(f"written: {' and '.join(map(str, made.written))}, {size}", made.warnings)


def _by_ending(out: Path) -> Format:
    if out.suffix.lower() not in _BY_ENDING:
        raise ValueError(f"{out}: the extension names no format; add --to with one of {', '.join(get_args(Format))}")
    return _BY_ENDING[out.suffix.lower()]


def _convert_log(source: Path, out: Path, to: Format) -> Conversion:
    if to not in ("tum", "carmen"):
        raise ValueError(f"{source}: a robot's log can be converted to tum or carmen, not {to}")
    log = load_robot_log(source)
    out.parent.mkdir(parents=True, exist_ok=True)
    if to == "tum":
        save_tum(out, log.odometry)
        return Conversion(f"written: {out}, odometry of {counted(len(log.scans), 'pose')}")
    save_carmen(out, log)
    return Conversion(f"written: {out}, {counted(len(log.scans), 'scan')}")


def _convert_run(run: Path, out: Path, to: Format) -> Conversion:
    if to == "map":
        raise ValueError(f"{run}: a run has several maps; give one of them, such as {run / 'robot_0' / 'map.yaml'}")
    require_new_folder(out)
    robots = load_run_robots(run)
    write = {"tum": _write_tum, "carmen": _write_carmen, "rosbag": _write_bag}[to]
    with atomic_folder(out) as folder:
        write(folder, robots)
    return Conversion(
        f"written: {out}, {to} of {counted(len(robots), 'log')}, "
        f"{counted(sum(len(robot.log.scans) for robot in robots), 'scan')}"
    )


def require_new_folder(out: Path) -> None:
    """Raise ``ValueError`` unless a folder for a bag or logs is new or empty."""
    if out.suffix.lower() in _BY_ENDING:
        raise ValueError(f"{out}: a run is written as a folder; choose a name without {out.suffix}")
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out}: exists and is not a folder")
    if out.exists() and any(out.iterdir()):
        raise ValueError(f"{out}: is not empty; choose a new folder")


def _write_tum(folder: Path, robots: Sequence[RunRobot]) -> None:
    for robot in robots:
        (folder / robot.name).mkdir()
        save_tum(folder / robot.name / "odometry.tum", robot.log.odometry)
        save_tum(folder / robot.name / "truth.tum", robot.world_from_base)


def _write_carmen(folder: Path, robots: Sequence[RunRobot]) -> None:
    for robot in robots:
        (folder / robot.name).mkdir()
        save_carmen(folder / robot.name / "log.carmen", robot.log, robot.world_from_base)


def _write_bag(folder: Path, robots: Sequence[RunRobot]) -> None:
    with rosbags_extra():
        from mapquilt.convert.ros_bag import write_bag
    write_bag(folder, robots)
