"""A run on disk: what each stage leaves for the next.

run.json             what made the run, and the mark by which mapquilt knows it as its own
maps.json            the map set that the merger reads; nothing of the truth
mission/             the clean mission: true poses, true ranges, the world
robot_0/             map.pgm, map.yaml and log.npz, as a real robot could bring them home
truth.json           where the maps truly lie
truth/               the world's true raster, and for each robot the part that it could have seen
coverage.json        how much of the world was seen as time went by; coverage.png beside it
merge.json           the merger's answer; merged.pgm, merged.yaml, conflicts, transforms.yaml and merge.png beside it
score.json           the answer against the truth; overview.png beside it
timings.json         seconds; all that differs between two runs of one seed
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.atomic import atomic_folder, write_files_atomically
from mapping.io.map_file import load_map
from mapping.io.robot_log_file import load_robot_log
from mapping.io.safe_path import safe_path
from mapping.map_set import MapSet
from mapping.robot.robot_log import RobotLog
from mapquilt.json_file import read_record, record_bytes

RUN_FILE = "run.json"
MAPS_FILE = "maps.json"
MISSION_FOLDER = "mission"
LOG_FILE = "log.npz"
TRUTH_FILE = "truth.json"
TRUTH_FOLDER = "truth"
COVERAGE_FILE = "coverage.json"
COVERAGE_PICTURE = "coverage.png"
MERGE_FILE = "merge.json"
SCORE_FILE = "score.json"
TIMINGS_FILE = "timings.json"
MERGED_NAME = "merged"
CONFLICTS_NAME = "conflicts"
TRANSFORMS_FILE = "transforms.yaml"
MERGE_PICTURE = "merge.png"
OVERVIEW_PICTURE = "overview.png"

ANSWER_FILES = (
    MERGE_FILE,
    f"{MERGED_NAME}.yaml",
    f"{MERGED_NAME}.pgm",
    f"{CONFLICTS_NAME}.yaml",
    f"{CONFLICTS_NAME}.pgm",
    TRANSFORMS_FILE,
    MERGE_PICTURE,
    SCORE_FILE,
    OVERVIEW_PICTURE,
    TIMINGS_FILE,
)
"""What ``merge`` and ``score`` add to a run."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""Names of maps become names of folders and of ROS topics."""

Timings = dict[str, dict[str, float]]
"""Seconds by stage and step."""


def is_run(folder: Path) -> bool:
    """Whether mapquilt wrote this folder as a run."""
    return (folder / RUN_FILE).is_file()


def refuse_foreign(folder: Path, mark: str = RUN_FILE) -> None:
    """Raise ``ValueError`` where writing there would overwrite what mapquilt did not write: a folder that is not
    empty must hold the record ``mark``, of a run or of a merge. What lies inside another run or merge would be lost
    with it, and is refused too."""
    kind = Path(mark).stem
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: exists and is not a folder")
    if (folder / mark).is_file():
        read_record(folder / mark, kind)
    elif folder.exists() and any(folder.iterdir()):
        raise ValueError(f"{folder}: is not empty and not a {kind} of mapquilt; refusing to replace it")
    for around in Path(os.path.realpath(folder)).parents:
        for record in (RUN_FILE, MERGE_FILE):
            if _holds(around, record):
                raise ValueError(f"{folder}: lies inside the {Path(record).stem} {around}; name a folder outside it")


def _holds(folder: Path, mark: str) -> bool:
    """Whether that record of mapquilt's lies in the folder; a file of another program's that has its name is none."""
    if not (folder / mark).is_file():
        return False
    try:
        read_record(folder / mark, Path(mark).stem)
    except ValueError:
        return False
    return True


@contextmanager
def new_run(folder: Path) -> Iterator[Path]:
    """A folder to write a run into; it takes the final name, whole, when the block ends well.

    A run of mapquilt's of that name is replaced. Raises ``ValueError`` for any other folder that is not empty.
    """
    refuse_foreign(folder)
    with atomic_folder(folder) as aside:
        yield aside


def require_run(folder: Path) -> Path:
    """The folder, if it is a run. Raises ``ValueError`` naming it, or what is wrong with its run.json, otherwise."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such run folder")
    if not is_run(folder):
        raise ValueError(f"{folder}: is not a run of mapquilt (it has no {RUN_FILE})")
    read_record(folder / RUN_FILE, "run")
    return folder


def mission_folder(folder: Path) -> Path:
    """Where a run's clean mission lies: inside it, or beside, where the samples of a data set share one.

    Raises ``ValueError`` naming the folder where it is missing.
    """
    record = read_record(require_run(folder) / RUN_FILE, "run")
    mission = folder / str(record["mission"])
    if not mission.is_dir():
        raise ValueError(f"{mission}: no such folder; the mission of {folder} is missing")
    return mission


def parts(folder: Path) -> int:
    """Into how many parts each robot's mission was cut in time: as many maps each. Raises ``ValueError`` where the
    folder is no run."""
    return int(read_record(require_run(folder) / RUN_FILE, "run")["parts"])


def load_maps(folder: Path) -> MapSet:
    """The map set of a run, from its map files alone.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong.
    """
    path = require_run(folder) / MAPS_FILE
    record = read_record(path, "maps")
    names = tuple(entry["name"] for entry in record["maps"])
    try:
        _check_names(names)
        files = [_map_file(folder, entry["file"]) for entry in record["maps"]]
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    loaded = [load_map(file) for file in files]
    return MapSet(
        names=names,
        grids=tuple(entry.grid for entry in loaded),
        units=tuple(entry.unit for entry in loaded),
        resolutions_trusted=record["resolutions_trusted"],
        provenance=record["provenance"],
    )


def true_rasters(folder: Path, maps: MapSet) -> tuple[OccupancyGrid, dict[str, OccupancyGrid]]:
    """The world's true raster, and of each map the part of it that its robot could have seen.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong.
    """
    truth = folder / TRUTH_FOLDER
    return load_map(truth / "world.yaml").grid, {name: load_map(truth / f"{name}.yaml").grid for name in maps.names}


def load_log(folder: Path, name: str) -> RobotLog:
    """The log that the robot of that map brought home.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing, wrong, or the log of another.
    """
    path = folder / name / LOG_FILE
    log = load_robot_log(path)
    if log.robot != name:
        raise ValueError(f"{path}: is the log of {log.robot[:100]!r}, not of {name!r}")
    return log


def _check_names(names: tuple[str, ...]) -> None:
    for name in names:
        if not _NAME.fullmatch(name):
            raise ValueError(f"name is {name[:100]!r}, must be letters, digits and underscores, a letter first")
        if names.count(name) > 1:
            raise ValueError(f"name is {name!r} more than once")


def _map_file(folder: Path, name: str) -> Path:
    file = safe_path(folder, name)
    if file is None:
        raise ValueError(f"file is {name[:100]!r}, outside the run's folder")
    if file.relative_to(folder).parts[:1] in ((TRUTH_FOLDER,), (MISSION_FOLDER,)):
        raise ValueError(f"file is {name[:100]!r}, which tells the truth: the merger may not read it")
    return file


def add_timings(folder: Path, stage: str, seconds: Mapping[str, float]) -> None:
    """Note what a stage took, beside the stages before it."""
    write_files_atomically(timings_file(folder, read_timings(folder), stage, seconds))


def timings_file(folder: Path, before: Timings, stage: str, seconds: Mapping[str, float]) -> dict[Path, bytes]:
    """A run's timings with those of one more stage, as bytes."""
    timings = {**before, stage: {name: round(value, 4) for name, value in seconds.items()}}
    path = folder / TIMINGS_FILE
    return {path: record_bytes(path, "timings", {"unit": "s", **timings})}


def read_timings(folder: Path) -> Timings:
    """A run's timings, empty where there are none.

    Raises ``ValueError`` that names the file and what is wrong with it, ``OSError`` where it cannot be read.
    """
    path = folder / TIMINGS_FILE
    timings = read_record(path, "timings") if path.exists() else {}
    timings.pop("unit", None)
    return timings
