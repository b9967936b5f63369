"""Folder of a run.

run.json             settings of the run; marks the folder as a run of mapquilt
maps.json            map set that the merger reads, without the truth
mission/             clean mission: true poses, true ranges, world
robot_0/             map.pgm, map.yaml and log.npz, as a real robot would record them
truth.json           true transforms of the maps
truth/               true raster of the world, and the part of it that each robot observed
coverage.json        observed share of the world over time, with coverage.png
merge.json           result of the merge, with merged.pgm, merged.yaml, conflicts, transforms.yaml and merge.png;
                     refused.png if maps were not joined; elastic.png if maps were bent; align.json and merged_yaw_0
                     if a person placed them
score.json           evaluation of the merge against the truth, with overview.png
timings.json         seconds; only this file differs between two runs of one seed
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.atomic import remove_temporaries
from mapping.io.map_file import load_map
from mapping.io.robot_log_file import load_robot_log
from mapping.io.safe_load import reading
from mapping.io.safe_path import safe_path
from mapping.io.transaction import LEDGER_FILE, atomic_folder, change_files, finish_transaction
from mapping.map_set import MapSet
from mapping.robot.robot_log import RobotLog
from mapquilt.json_file import read_record, record_bytes

RUN_FILE = "run.json"
MAPS_FILE = "maps.json"
MISSION_FOLDER = "mission"
TRAJECTORY_FILE = "trajectory.tum"
LOG_FILE = "log.npz"
LOG_MAP_PICTURE = "map.png"
TRUTH_FILE = "truth.json"
TRUTH_FOLDER = "truth"
COVERAGE_FILE = "coverage.json"
COVERAGE_PICTURE = "coverage.png"
MERGE_FILE = "merge.json"
SCORE_FILE = "score.json"
TIMINGS_FILE = "timings.json"
MERGED_NAME = "merged"
CONFLICTS_NAME = "conflicts"
YAW_ZERO_NAME = "merged_yaw_0"
IN_FRAME_NAME = "merged_in_frame"
TRANSFORMS_FILE = "transforms.yaml"
MERGE_PICTURE = "merge.png"
REFUSED_PICTURE = "refused.png"
ELASTIC_PICTURE = "elastic.png"
ALIGN_FILE = "align.json"
OVERVIEW_PICTURE = "overview.png"

MANIFEST_FILE = "manifest.jsonl"
"""Marks the folder of a finished data set, in whose samples runs lie."""

ANSWER_FILES = (
    MERGE_FILE,
    f"{MERGED_NAME}.yaml",
    f"{MERGED_NAME}.pgm",
    f"{YAW_ZERO_NAME}.yaml",
    f"{YAW_ZERO_NAME}.pgm",
    f"{IN_FRAME_NAME}.yaml",
    f"{IN_FRAME_NAME}.pgm",
    f"{CONFLICTS_NAME}.yaml",
    f"{CONFLICTS_NAME}.pgm",
    TRANSFORMS_FILE,
    MERGE_PICTURE,
    REFUSED_PICTURE,
    ELASTIC_PICTURE,
    ALIGN_FILE,
    SCORE_FILE,
    OVERVIEW_PICTURE,
    TIMINGS_FILE,
)
"""Files that ``merge``, ``align`` and ``score`` add to a run."""

OF_A_GROUP = re.compile(rf"(?:{MERGED_NAME}|{CONFLICTS_NAME})_\d+\.(?:yaml|pgm)")
"""Maps of the further groups of a merge."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""Valid names of maps, which become names of folders and of ROS topics."""

_MISSION = re.compile(rf"{MISSION_FOLDER}|\.\./\.\./missions/[A-Za-z0-9_-]+")
"""Valid places of a run's mission: its own, or one that the samples of a data set share."""

Timings = dict[str, dict[str, float]]
"""Seconds by stage and step."""


def is_run(folder: Path) -> bool:
    """Check if the folder is a run of mapquilt. A transaction that a killed writer left there is finished first."""
    finish_transaction(folder)
    return (folder / RUN_FILE).is_file()


def refuse_foreign(folder: Path, mark: str = RUN_FILE) -> None:
    """Raise ``ValueError`` if writing to the folder would overwrite files of others.

    A folder that is not empty must hold the record ``mark``, of a run or of a merge. A folder inside another run or
    merge is refused too, since their files would mix, and one inside a finished data set, which would no longer be as
    it was made. What a killed writer left there is finished or removed first.
    """
    kind = Path(mark).stem
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: exists and is not a folder")
    if folder.exists():
        finish_transaction(folder)
        remove_temporaries(folder)
    if (folder / mark).is_file():
        read_record(folder / mark, kind)
    elif folder.exists() and any(folder.iterdir()):
        raise ValueError(f"{folder}: is not empty and holds no {mark} of mapquilt; refusing to replace it")
    for around in Path(os.path.realpath(folder)).parents:
        for record in (RUN_FILE, MERGE_FILE):
            if _holds(around, record):
                raise ValueError(f"{folder}: lies inside the {Path(record).stem} {around}; name a folder outside it")
        if _is_dataset(around):
            raise ValueError(f"{folder}: lies inside the data set {around}; name a folder outside it")


def spare_inputs(out: Path, inputs: Iterable[Path]) -> None:
    """Raise ``ValueError`` if one of the inputs is ``out`` or lies in it, since writing replaces that folder."""
    replaced = Path(os.path.realpath(out))
    for each in inputs:
        if Path(os.path.realpath(each)).is_relative_to(replaced):
            raise ValueError(f"{out}: would replace the input {each}; name another folder")


def _holds(folder: Path, mark: str) -> bool:
    """Check if the folder holds a valid record of that name; another program's file of the same name does not count."""
    if not (folder / mark).is_file():
        return False
    try:
        read_record(folder / mark, Path(mark).stem)
    except ValueError:
        return False
    return True


def _is_dataset(folder: Path) -> bool:
    """Check if the folder is a finished data set; another program's file of the same name does not count."""
    path = folder / MANIFEST_FILE
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return b"mapquilt-manifest/" in file.readline(1000)


@contextmanager
def new_run(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder to write a run into, whose files are those of ``folder`` when the block succeeds.

    Of an existing run, the files that mapquilt wrote are replaced or deleted; all others stay. Raises ``ValueError``
    for any other folder that is not empty.
    """
    refuse_foreign(folder)
    with atomic_folder(folder, ledger=True, stale=ANSWER_FILES) as aside:
        yield aside


def is_answer(name: str) -> bool:
    """Check if ``merge`` or ``score`` adds a file of that name to a folder."""
    return name in (*ANSWER_FILES, LEDGER_FILE) or OF_A_GROUP.fullmatch(name) is not None


def require_run(folder: Path) -> Path:
    """Return the folder if it is a run. Raises ``ValueError`` naming it, or the fault of its run.json, otherwise."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such run folder")
    if not is_run(folder):
        raise ValueError(f"{folder}: is not a run of mapquilt (it has no {RUN_FILE})")
    remove_temporaries(folder, "mapquilt")
    read_record(folder / RUN_FILE, "run")
    return folder


def is_recorded(folder: Path) -> bool:
    """Check if the maps of a run were drawn from recorded logs, so that it has no mission."""
    return read_record(require_run(folder) / RUN_FILE, "run")["mission"] is None


def mission_folder(folder: Path) -> Path:
    """Return the folder of a run's clean mission, which the samples of a data set share.

    Raises ``ValueError`` naming the folder if it is missing.
    """
    record = read_record(require_run(folder) / RUN_FILE, "run")
    if record["mission"] is None:
        raise ValueError(f"{folder}: its maps were drawn from recorded logs; it has no mission")
    if not _MISSION.fullmatch(record["mission"]):
        raise ValueError(
            f"{folder / RUN_FILE}: mission is {record['mission'][:100]!r}, must be {MISSION_FOLDER!r}, "
            "or the mission's folder in a data set"
        )
    mission = folder / str(record["mission"])
    if not mission.is_dir():
        raise ValueError(f"{mission}: no such folder; the mission of {folder} is missing")
    return mission


def parts(folder: Path) -> int:
    """Return the number of maps that each robot's mission was cut into. Raises ``ValueError`` if this is not a run."""
    return int(read_record(require_run(folder) / RUN_FILE, "run")["parts"])


def load_maps(folder: Path) -> MapSet:
    """Load the map set of a run from its map files alone.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong.
    """
    files = map_files(require_run(folder))
    record = read_record(folder / MAPS_FILE, "maps")
    loaded = [load_map(file) for file in files.values()]
    return MapSet(
        names=tuple(files),
        grids=tuple(entry.grid for entry in loaded),
        units=tuple(entry.unit for entry in loaded),
        resolutions_trusted=record["resolutions_trusted"],
        provenance=record["provenance"],
    )


def map_files(folder: Path) -> dict[str, Path]:
    """Return the YAML of each map of a run by its name.

    Raises ``ValueError`` naming the file if it is missing or wrong, or a map lies outside of the folder.
    """
    path = folder / MAPS_FILE
    entries = read_record(path, "maps")["maps"]
    with reading(path):
        _check_names(tuple(entry["name"] for entry in entries))
        return {entry["name"]: _map_file(folder, entry["file"]) for entry in entries}


def true_rasters(folder: Path, maps: MapSet) -> tuple[OccupancyGrid, dict[str, OccupancyGrid]]:
    """Load the true raster of the world, and the true footprint of each map by name.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing or wrong.
    """
    truth = folder / TRUTH_FOLDER
    return load_map(truth / "world.yaml").grid, {name: load_map(truth / f"{name}.yaml").grid for name in maps.names}


def load_log(folder: Path, name: str) -> RobotLog:
    """Load the robot log behind a map.

    Raises ``ValueError`` or ``OSError`` naming the file that is missing, wrong, or the log of another robot.
    """
    path = folder / name / LOG_FILE
    log = load_robot_log(path)
    if log.robot != name:
        raise ValueError(f"{path}: is the log of {log.robot[:100]!r}, not of {name!r}")
    return log


def _check_names(names: tuple[str, ...]) -> None:
    for name in names:
        if not _NAME.fullmatch(name):
            raise ValueError(f"name is {name[:100]!r}, must be letters, digits and underscores, with a letter first")
        if names.count(name) > 1:
            raise ValueError(f"name is {name!r} more than once")


def _map_file(folder: Path, name: str) -> Path:
    file = safe_path(folder, name)
    if file is None:
        raise ValueError(f"file is {name[:100]!r}, must lie inside the run's folder")
    if file.relative_to(folder).parts[:1] in ((TRUTH_FOLDER,), (MISSION_FOLDER,)):
        raise ValueError(f"file is {name[:100]!r}, must not be part of the truth, which the merger may not read")
    return file


def add_timings(folder: Path, stage: str, seconds: Mapping[str, float]) -> None:
    """Add the times of a stage to a run's timings.json."""
    change_files(folder, timings_file(folder, read_timings(folder), stage, seconds), ())


def timings_file(folder: Path, before: Timings, stage: str, seconds: Mapping[str, float]) -> dict[Path, bytes]:
    """Return timings.json with the times of one more stage, as bytes."""
    timings = {**before, stage: {name: round(value, 4) for name, value in seconds.items()}}
    path = folder / TIMINGS_FILE
    return {path: record_bytes(path, "timings", {"unit": "s", **timings})}


def read_timings(folder: Path) -> Timings:
    """Read a run's timings; empty if there are none.

    Raises ``ValueError`` naming the file and the fault, ``OSError`` if it cannot be read.
    """
    path = folder / TIMINGS_FILE
    timings = read_record(path, "timings") if path.exists() else {}
    timings.pop("unit", None)
    return timings
