"""``mapquilt play``: a run as a stream of messages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mapping.io.transaction import atomic_folder
from mapping.slam.front_end import FRONT_ENDS
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import RunFolder, path
from mapquilt.cli.tables import print_table
from mapquilt.convert.conversion import require_new_folder
from mapquilt.jobs.progress import count_progress, mapping_label
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.runs.folder import require_run
from mapquilt.runs.robot import load_run_robots


def play(
    run: RunFolder,
    out: Annotated[
        Path, typer.Option("--out", parser=path, help="New or empty folder for a ROS 2 bag, in simulated time.")
    ],
    period: Annotated[float, typer.Option(help="Time between two maps of a robot [s].")] = 2.0,
    resolution: Annotated[float, typer.Option(help="Cell size of the maps [m].")] = 0.05,
    poses: Annotated[str, typer.Option(help=f"Poses that robots map with: {', '.join(FRONT_ENDS)}.")] = "slam",
) -> int:
    """Write what the robots of a run would send: maps as they grow, scans, odometry, tf and clock.

    Each robot maps in the frame of its start, which no other knows. Needs `pip install mapquilt[ros]`. `mapquilt live
    --from` merges the maps of the bag; `ros2 bag play` sends them to any program.

    Example: mapquilt play runs/office --out office_team
    """
    if poses not in FRONT_ENDS:
        raise ValueError(f"--poses {poses}: must be one of {', '.join(FRONT_ENDS)}")
    if not period > 0.0:
        raise ValueError(f"--period {period:g}: must be positive [s]")
    if not 0.005 <= resolution <= 10.0:
        raise ValueError(f"--resolution {resolution:g}: must lie between 0.005 and 10 m")
    require_new_folder(out)
    with rosbags_extra():
        from mapquilt.convert.ros_bag import new_bag
        from mapquilt.live.simulated_team import start_poses, team_messages
    robots = load_run_robots(require_run(run))
    with count_progress(f"{mapping_label()}, robots") as on_progress:
        paths = start_poses(robots, poses, on_progress)
    total, maps = sum(len(robot.log.scans) for robot in robots), 0
    with count_progress("writing scans") as on_progress, atomic_folder(out) as folder, new_bag(folder) as bag:
        done = 0
        for topic, message, nanoseconds in team_messages(robots, paths, period, resolution):
            bag.write(topic, message, nanoseconds)
            maps += topic.endswith("/map")
            done += topic.endswith("/scan")
            on_progress(done, total)
    print_table(
        f"written: {out}, {counted(maps, 'map')} and {counted(total, 'scan')} of {counted(len(robots), 'robot')}; "
        f"mapquilt live --from {out} merges them"
    )
    return ALL_MERGED
