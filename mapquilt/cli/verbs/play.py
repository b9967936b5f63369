"""``mapquilt play``: a run as a stream of messages."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mapping.io.transaction import atomic_folder
from mapping.slam.front_end import FRONT_ENDS
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED
from mapquilt.cli.options.files import RunFolder, path
from mapquilt.cli.tables import print_table
from mapquilt.convert.conversion import require_new_folder
from mapquilt.jobs.progress import count_progress, mapping_label
from mapquilt.live.ros2.live_extra import live_extra, ros_domain
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.runs.folder import require_run
from mapquilt.runs.robot import load_run_robots

if TYPE_CHECKING:
    from mapquilt.live.simulated_team import Sent


def play(
    run: RunFolder,
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=path, help="New or empty folder for a ROS 2 bag; default: topics of the network."),
    ] = None,
    period: Annotated[float, typer.Option(help="Time between two maps of a robot [s].")] = 2.0,
    resolution: Annotated[float, typer.Option(help="Cell size of the maps [m].")] = 0.05,
    poses: Annotated[
        str,
        typer.Option(
            help="Poses that robots map with: online (as SLAM has them at the time of each map), slam (of the whole "
            "log), odometry."
        ),
    ] = "online",
    speed: Annotated[float, typer.Option(help="Without --out: factor on the speed of time.")] = 1.0,
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="DDS domain; default: ROS_DOMAIN_ID, else 0.")
    ] = None,
) -> int:
    """Send what the robots of a run would send: maps as they grow, scans, odometry, tf and clock.

    Each robot maps in the frame of its start, which no other knows. With --out it is written to a bag in simulated time
    (`pip install mapquilt[ros]`), whose maps `mapquilt live --from` merges. Without it, it is sent to the network, with
    no ROS installed (`pip install mapquilt[live]`), to `mapquilt live` or any node.

    Example: mapquilt play runs/office --out office_team
    """
    if not speed > 0.0:
        raise ValueError(f"--speed {speed:g}: must be positive")
    if out is not None and domain is not None:
        raise ValueError("--domain: goes with topics of the network, not with --out")
    if poses not in (allowed := ("online", *FRONT_ENDS)):
        raise ValueError(f"--poses {poses}: must be one of {', '.join(allowed)}")
    if not period > 0.0:
        raise ValueError(f"--period {period:g}: must be positive [s]")
    if not 0.005 <= resolution <= 10.0:
        raise ValueError(f"--resolution {resolution:g}: must lie between 0.005 and 10 m")
    if out is not None:
        require_new_folder(out)
    with rosbags_extra() if out is not None else live_extra():
        from mapquilt.live.simulated_team import pose_sources, team_messages
    robots = load_run_robots(require_run(run))
    with count_progress(f"{mapping_label()}, robots") as on_progress:
        sources = pose_sources(robots, poses, on_progress)
    sent, total = team_messages(robots, sources, period, resolution), sum(len(robot.log.scans) for robot in robots)
    maps = _send(sent, ros_domain(domain), speed, total) if out is None else _write(sent, out, total)
    what = f"{counted(maps, 'map')} and {counted(total, 'scan')} of {counted(len(robots), 'robot')}"
    print_table(f"sent: {what}" if out is None else f"written: {out}, {what}; mapquilt live --from {out} merges them")
    return ALL_MERGED


def _write(sent: Iterable[Sent], out: Path, total: int) -> int:
    """Write messages to a bag; return the number of maps."""
    from mapquilt.convert.ros_bag import new_bag

    maps = done = 0
    with count_progress("writing scans") as on_progress, atomic_folder(out) as folder, new_bag(folder) as bag:
        for topic, message, nanoseconds in sent:
            bag.write(topic, message, nanoseconds)
            maps += topic.endswith("/map")
            done += topic.endswith("/scan")
            on_progress(done, total)
    return maps


def _send(sent: Iterable[Sent], domain: int, speed: float, total: int) -> int:
    """Send messages to the network at their time; return the number of maps."""
    with live_extra():
        from mapquilt.live.ros2.network import LATCHED, STREAM, Network
    network, start, first = Network(domain), time.monotonic(), None
    maps = done = 0
    with count_progress("sending scans") as on_progress:
        for topic, message, nanoseconds in sent:
            first = nanoseconds if first is None else first
            time.sleep(max(0.0, start + 1e-9 * (nanoseconds - first) / speed - time.monotonic()))
            is_map = topic.endswith("/map")
            network.publish(topic, message, LATCHED if is_map or topic == "/tf_static" else STREAM)
            maps += is_map
            done += topic.endswith("/scan")
            on_progress(done, total)
        time.sleep(1.0)  # for readers that are behind: a latched map goes with its publisher
    return maps
