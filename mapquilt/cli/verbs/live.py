"""``mapquilt live``: merge the maps of running robots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from mapping.io.safe_load import printable
from mapping.io.transaction import atomic_folder
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.options.files import path
from mapquilt.cli.tables import print_table
from mapquilt.convert.conversion import require_new_folder
from mapquilt.jobs.progress import count_progress
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.merge_of_state import record_merge
from mapquilt.live.topics import TopicChoice
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.merging.merge_folder import refuse_merge
from mapquilt.viz.text_table import plain_table

if TYPE_CHECKING:
    from mapquilt.live.replay import Moment


def live(
    source: Annotated[
        Path, typer.Option("--from", metavar="BAG", help="Bag to merge in bag time: .mcap, .db3, .bag, or a folder.")
    ],
    topic: Annotated[
        list[str] | None, typer.Option("--topic", help="Topic of a robot's map; default: all maps. Repeatable.")
    ] = None,
    discover: Annotated[
        str | None, typer.Option(metavar="PATTERN", help="Take the maps whose topic matches, such as '/robot_*/map'.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=path, help="New or empty folder for a bag of all that is published."),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option("--record", metavar="DIR", parser=path, help="Folder for the last merge, as `merge` writes it."),
    ] = None,
    freeze_after: Annotated[
        float | None, typer.Option(help="Hold all poses from so long after the first map on [s].")
    ] = None,
    frame: Annotated[str, typer.Option(help="Frame of the merged map.")] = "map_merged",
    out_topic: Annotated[str, typer.Option(help="Topic of the merged map.")] = "/map_merged",
) -> int:
    """Merge the maps of robots in the order in which they came, without a jump of the merged map.

    A map joins once its pose is confirmed, then moves in small steps only, and leaves with a reason if new cells
    contradict its pose. Needs `pip install mapquilt[ros]`. Exit status 1 if a robot has not joined at the end.

    Example: mapquilt live --from office_team --record merged
    """
    if not frame or not out_topic.startswith("/"):
        raise ValueError(
            f"--frame {frame!r} and --out-topic {out_topic!r}: need a name, and a topic that starts with /"
        )
    if out is not None:
        require_new_folder(out)
    if record is not None:
        refuse_merge(record, [source])
    with rosbags_extra():
        from mapquilt.convert.ros_bag import new_bag
        from mapquilt.live.bag_maps import bag_maps
        from mapquilt.live.published import Names
        from mapquilt.live.replay import PublishedBag, replay
    merger, moments = LiveMerger(), []
    with count_progress("merging maps") as on_progress, ExitStack() as stack:
        bag = None
        if out is not None:
            writer = stack.enter_context(new_bag(stack.enter_context(atomic_folder(out))))
            bag = PublishedBag(writer, merger, Names(frame, out_topic))
        for moment in replay(merger, bag_maps(source, TopicChoice(topic or (), discover), on_progress), freeze_after):
            moments.append((moment.now, moment.seconds))
            _tell(moment, moments[0][0])
            if bag is not None:
                bag.write(moment)
        if bag is not None:
            bag.close()
    if record is not None:
        record_merge(record, merger.state, merger.settings)
    print_table(_table(merger.state, [seconds for _, seconds in moments]))
    for folder, text in ((out, "all that was published"), (record, "the last merge")):
        if folder is not None:
            typer.echo(f"written: {folder}, {text}")
    return ALL_MERGED if len(merger.state.poses) == len(merger.state.robots) else SOME_REFUSED


def _tell(moment: Moment, start: float) -> None:
    """Print what a moment has changed."""
    for event in moment.state.events:
        typer.echo(f"{moment.now - start:8.1f} s  {printable(event)}")


def _table(state: LiveState, seconds: Sequence[float]) -> Table:
    """Tabulate the robots and their poses in the merged frame."""
    table = plain_table(
        ("robot", False), ("state", False), ("cells", True), ("x, y [m]", True), ("yaw [deg]", True), ("reason", False)
    )
    for name, robot in state.robots.items():
        placement, pose = state.placements[name], state.poses.get(name)
        table.add_row(
            name,
            placement.state.value,
            str(robot.known_cells),
            "-" if pose is None else f"{pose.x:.2f}, {pose.y:.2f}",
            "-" if pose is None else f"{math.degrees(pose.yaw):.1f}",
            placement.reason,
        )
    table.caption = (
        f"{len(state.poses)} of {counted(len(state.robots), 'robot')} joined; {counted(len(seconds), 'update')}"
        + (f", median {median(seconds):.2f} s, longest {max(seconds):.2f} s" if seconds else "")
    )
    return table
