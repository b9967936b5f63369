"""Pictures of the pose graphs of a run that SLAM mapped, as ``mapquilt map`` draws them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from mapping.settings import LOG_ODDS, MappingSettings
from mapping.wording import counted
from mapquilt.json_file import read_record
from mapquilt.logs.load_log import LogSource, load_log
from mapquilt.logs.log_map import LogMap, draw_logs
from mapquilt.logs.map_figure import map_figure
from mapquilt.report.content import Picture, own_picture
from mapquilt.runs import folder as run_folder
from mapquilt.viz.png import figure_png

SLAM = "slam"


def pose_graphs(folder: Path, on_progress: Callable[[int, int], None]) -> list[Picture]:
    """Draw the pose graph of each robot, in the frame of its start; none if the run was not mapped by SLAM.

    A run holds no pose graphs, so its logs are mapped again with the settings of its record. Runs of
    recorded logs have the pictures already. ``on_progress`` gets the scans done and their total.
    """
    record = read_record(folder / run_folder.RUN_FILE, "run")
    if record["poses"] != SLAM:
        return []
    if record["mission"] is None:
        names = run_folder.load_maps(folder).names
        found = [(name, own_picture(folder, f"{name}/{run_folder.LOG_MAP_PICTURE}")) for name in names]
        return [_picture(name, data, "") for name, data in found if data is not None]
    settings = MappingSettings(
        SLAM, record["resolution_m"], record["sensor_model"], record["clear_range_m"], mapper=LOG_ODDS
    )
    drawn = draw_logs(load_log(folder, LogSource()), settings, on_progress)
    return [_picture(one.name, figure_png(map_figure(one)), _counts(one)) for one in drawn]


def _counts(drawn: LogMap) -> str:
    loops = len(drawn.result.loops)
    return f"{counted(drawn.result.keyframes.size, 'keyframe')} and {counted(loops, 'loop')}. "


def _picture(name: str, png: bytes, counts: str) -> Picture:
    return Picture(
        name,
        png,
        f"Map of {name} with the path that SLAM estimated, its keyframes, and a line for each loop",
        f"{counts}The map in the frame of the robot's start, with the path that SLAM estimated, "
        "its keyframes as dots, a line for each loop that it closed, and the true path dashed.",
        small=True,
    )
