"""Loading the log of a robot, whatever program wrote it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from mapping.io.carmen_reader import load_carmen
from mapping.io.robot_log_file import load_robot_log
from mapping.io.tum import load_tum
from mapping.robot.recorded_log import RecordedLog, covered_scans
from mapquilt.logs.log_files import BAG_METADATA, CARMEN_ENDINGS, LOG_ENDINGS, is_bag, log_name
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.runs import folder as run_folder
from mapquilt.runs.robot import load_run_robots

LoadingProgress = Callable[[int, int], None]
"""Called with the number of messages read and their total."""


@dataclass(frozen=True)
class LogSource:
    """Choose what to read of a log.

    - ``scan_topic``, ``odom_topic``: topics of a bag; None: the only one;
    - ``odometry``, ``reference``: TUM files whose poses replace those of the log; None: its own;
    - ``start``, ``end`` [s]: the part of the log, counted from its first scan; None: to the last;
    - ``max_rate`` [Hz]: scans beyond are left out. Mappers use no more than some scans per second: 10 Hz at 1 m/s is
      one scan every 0.1 m.

    Raises ``ValueError`` naming the field and the value.
    """

    scan_topic: str | None = None
    odom_topic: str | None = None
    odometry: Path | None = None
    reference: Path | None = None
    start: float = 0.0
    end: float | None = None
    max_rate: float = 10.0

    def __post_init__(self) -> None:
        if not self.start >= 0.0:
            raise ValueError(f"start is {self.start:g}, must be at least 0 s")
        if self.end is not None and not self.end > self.start:
            raise ValueError(f"end is {self.end:g}, must be after the start, {self.start:g} s")
        if not self.max_rate > 0.0:
            raise ValueError(f"max_rate is {self.max_rate:g}, must be positive")


@dataclass(frozen=True, eq=False)
class NamedLog:
    """A log, the ``name`` of its robot, and the file or folder that it came from."""

    name: str
    recorded: RecordedLog
    path: Path


def load_log(path: Path, source: LogSource, on_progress: LoadingProgress | None = None) -> tuple[NamedLog, ...]:
    """Load a CARMEN log, a ROS bag, a robot's ``log.npz``, or every log of a run.

    Raises ``ValueError`` or ``OSError`` naming the file and what is wrong, ``ImportError`` if a bag needs rosbags.
    """
    if path.is_dir() and run_folder.is_run(path):
        logs = _run_logs(path)
    else:
        logs = (NamedLog(log_name(path), _load_file(path, source, on_progress), path),)
    try:
        return tuple(replace(log, recorded=_selected(log.recorded, source)) for log in logs)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _load_file(path: Path, source: LogSource, on_progress: LoadingProgress | None) -> RecordedLog:
    for option, topic in (("--scan-topic", source.scan_topic), ("--odom-topic", source.odom_topic)):
        if topic is not None and not is_bag(path):
            raise ValueError(f"{option} {topic}: {path} is no bag, so it has no topics")
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such file or folder")
    if is_bag(path):
        with rosbags_extra():
            from mapquilt.logs.bag_log import load_bag
        return load_bag(path, source.scan_topic, source.odom_topic, source.max_rate, on_progress)
    if path.is_dir():
        raise ValueError(f"{path}: is neither a run nor a ROS 2 bag (it has no {BAG_METADATA})")
    if path.suffix.lower() == ".npz":
        return RecordedLog(load_robot_log(path))
    if path.suffix.lower() in CARMEN_ENDINGS:
        return load_carmen(path, source.max_rate)
    raise ValueError(f"{path}: must be a run, or end in {', '.join(LOG_ENDINGS)}")


def _run_logs(run: Path) -> tuple[NamedLog, ...]:
    if run_folder.is_recorded(run):
        return tuple(_recorded_log(run, name) for name in run_folder.load_maps(run).names)
    return tuple(NamedLog(one.name, RecordedLog(one.log, one.world_from_base), run) for one in load_run_robots(run))


def _recorded_log(run: Path, name: str) -> NamedLog:
    """Load a part of a log that was mapped before."""
    reference = run / run_folder.TRUTH_FOLDER / f"{name}.tum"
    poses = load_tum(reference) if reference.is_file() else None
    return NamedLog(name, RecordedLog(run_folder.load_log(run, name), poses), run)


def _selected(recorded: RecordedLog, source: LogSource) -> RecordedLog:
    for field, path in (("odometry", source.odometry), ("reference", source.reference)):
        if path is not None:
            recorded = _with_poses(recorded, field, path)
    return recorded.window(source.start, source.end).thinned(source.max_rate)


def _with_poses(recorded: RecordedLog, field: str, path: Path) -> RecordedLog:
    """Replace odometry or reference by the poses of a TUM file."""
    poses = load_tum(path)
    stamps = recorded.log.odometry.stamps
    kept, warnings = covered_scans(stamps.tolist(), poses)
    recorded = replace(recorded.select(kept), warnings=(*recorded.warnings, *(f"{path}: {text}" for text in warnings)))
    placed = poses.interpolated(stamps[kept])
    if field == "reference":
        return replace(recorded, reference=placed)
    return replace(recorded, log=replace(recorded.log, odometry=placed), has_odometry=True)
