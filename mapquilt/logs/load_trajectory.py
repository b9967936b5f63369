"""Loading a trajectory to evaluate, or one to evaluate against."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

from mapping.io.tum import load_tum
from mapping.robot.recorded_log import RecordedLog
from mapping.robot.trajectory import Trajectory
from mapquilt.logs.load_log import LogSource, NamedLog, load_log
from mapquilt.logs.log_files import LOG_ENDINGS
from mapquilt.runs import folder as run_folder

Poses = Literal["odometry", "reference"]
POSES: tuple[Poses, ...] = get_args(Poses)

TUM_ENDINGS = (".tum", ".txt")
_EVERY_SCAN = LogSource(max_rate=1e6)


def load_trajectory(path: Path, poses: Poses, robot: str | None = None) -> Trajectory:
    """Load a TUM file, the odometry or the reference poses of a log or of a robot of a run, or the trajectory of a map.

    ``robot`` names the robot of a run that has several. A map that ``mapquilt map`` drew, alone or in a run, gives its
    estimated trajectory in place of odometry. Raises ``ValueError`` or ``OSError`` naming the file and what is wrong.
    """
    if path.suffix.lower() in TUM_ENDINGS:
        return load_tum(path)
    if path.is_dir() and not run_folder.is_run(path) and (path / run_folder.TRAJECTORY_FILE).is_file():
        return load_tum(path / run_folder.TRAJECTORY_FILE)
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file or folder")
    if not path.is_dir() and path.suffix.lower() not in LOG_ENDINGS:
        raise ValueError(f"{path}: must be a run, a map of a log, or end in {', '.join((*TUM_ENDINGS, *LOG_ENDINGS))}")
    log = _of_robot(path, load_log(path, _EVERY_SCAN), robot)
    estimated = path / log.name / run_folder.TRAJECTORY_FILE
    if poses == "odometry" and estimated.is_file():
        return load_tum(estimated)
    return _poses(path, log.recorded, poses)


def _of_robot(path: Path, logs: tuple[NamedLog, ...], robot: str | None) -> NamedLog:
    names = ", ".join(log.name for log in logs)
    if robot is None:
        if len(logs) > 1:
            raise ValueError(f"{path}: has {len(logs)} robots; choose with --robot: {names}")
        return logs[0]
    found = [log for log in logs if log.name == robot]
    if not found:
        raise ValueError(f"--robot {robot}: {path} has no such robot, only {names}")
    return found[0]


def _poses(path: Path, recorded: RecordedLog, poses: Poses) -> Trajectory:
    if poses == "odometry":
        if not recorded.has_odometry:
            raise ValueError(f"{path}: has no odometry")
        return recorded.log.odometry
    if recorded.reference is None:
        raise ValueError(f"{path}: has no reference poses")
    return recorded.reference
