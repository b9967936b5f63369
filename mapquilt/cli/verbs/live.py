"""``mapquilt live``: merge the maps of running robots."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
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
from mapquilt.live.live_extra import live_extra, ros_domain
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
        Path | None,
        typer.Option("--from", metavar="BAG", help="Bag to merge in bag time: .mcap, .db3, .bag, or a folder."),
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option("--topic", help="Topic of a robot's map; default in a bag: all maps. Repeatable."),
    ] = None,
    discover: Annotated[
        str | None, typer.Option(metavar="PATTERN", help="Take the maps whose topic matches, such as '/robot_*/map'.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", parser=path, help="With --from: new or empty folder for a bag of all that is published."),
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
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="DDS domain; default: ROS_DOMAIN_ID, else 0.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Without --from: stop after so long [s]; default: at an interrupt.")
    ] = None,
) -> int:
    """Merge the maps of robots in the order in which they come, without a jump of the merged map.

    A map joins once its pose is confirmed, then moves in small steps only, and leaves with a reason if new cells
    contradict its pose. Without --from, topics of the network are merged and the result is published, with no ROS
    installed (`pip install mapquilt[live]`). A bag needs `pip install mapquilt[ros]`. Exit status 1 if a robot has not
    joined at the end.

    Example: mapquilt live --discover '/robot_*/map' --record merged
    """
    _check_options(source, topic, discover, out, frame=frame, out_topic=out_topic, of_network=(domain, duration))
    if out is not None:
        require_new_folder(out)
    if record is not None:
        refuse_merge(record, [] if source is None else [source])
    merger, choice = LiveMerger(), TopicChoice(topic or (), discover)
    if source is not None:
        moments = _bag_moments(merger, source, choice, out, freeze_after=freeze_after, frame=frame, out_topic=out_topic)
    else:
        moments = _network_moments(
            merger,
            choice,
            freeze_after=freeze_after,
            frame=frame,
            out_topic=out_topic,
            domain=domain,
            duration=duration,
        )
    seconds = [moment.seconds for moment in moments]
    if record is not None:
        record_merge(record, merger.state, merger.settings)
    print_table(_table(merger.state, seconds))
    for folder, text in ((out, "all that was published"), (record, "the last merge")):
        if folder is not None:
            typer.echo(f"written: {folder}, {text}")
    return ALL_MERGED if len(merger.state.poses) == len(merger.state.robots) else SOME_REFUSED


def _check_options(
    source: Path | None,
    topic: list[str] | None,
    discover: str | None,
    out: Path | None,
    *,
    frame: str,
    out_topic: str,
    of_network: tuple[float | None, ...],
) -> None:
    """Raise ``ValueError`` for options that do not go together; ``of_network`` are those that no bag takes."""
    if not frame or not out_topic.startswith("/"):
        raise ValueError(
            f"--frame {frame!r} and --out-topic {out_topic!r}: need a name, and a topic that starts with /"
        )
    if source is None and not topic and discover is None:
        raise ValueError("--topic, --discover or --from: one is needed to say which maps to merge")
    if source is None and out is not None:
        raise ValueError(f"--out {out}: goes with --from; `ros2 bag record` records topics of the network")
    if source is not None and any(value is not None for value in of_network):
        raise ValueError("--domain and --duration: go with topics of the network, not with --from")


def _bag_moments(
    merger: LiveMerger,
    source: Path,
    choice: TopicChoice,
    out: Path | None,
    *,
    freeze_after: float | None,
    frame: str,
    out_topic: str,
) -> Iterator[Moment]:
    """Merge a bag, tell what changes, and write what is published to a bag of its own."""
    with rosbags_extra():
        from mapquilt.convert.ros_bag import new_bag
        from mapquilt.live.bag_maps import bag_maps
        from mapquilt.live.published import Names
        from mapquilt.live.replay import PublishedBag, replay
    with count_progress("merging maps") as on_progress, ExitStack() as stack:
        bag, start = None, None
        if out is not None:
            writer = stack.enter_context(new_bag(stack.enter_context(atomic_folder(out))))
            bag = PublishedBag(writer, merger, Names(frame, out_topic))
        for moment in replay(merger, bag_maps(source, choice, on_progress), freeze_after):
            start = moment.now if start is None else start
            _tell(moment.now - start, moment.state.events)
            if bag is not None:
                bag.write(moment)
            yield moment
        if bag is not None:
            bag.close()


def _network_moments(
    merger: LiveMerger,
    choice: TopicChoice,
    *,
    freeze_after: float | None,
    frame: str,
    out_topic: str,
    domain: int | None,
    duration: float | None,
) -> Iterator[Moment]:
    """Merge topics of the network until an interrupt or the end of the time, and tell what changes."""
    with live_extra():
        from mapquilt.live.network import Network
        from mapquilt.live.online import merge_online
        from mapquilt.live.published import Names
        from mapquilt.live.replay import Moment
    network, start = Network(ros_domain(domain)), time.time()
    first: float | None = None

    def is_over() -> bool:
        now = time.time()
        if first is not None and freeze_after is not None and now - first >= freeze_after:
            merger.frozen = True
        return duration is not None and now - start >= duration

    try:
        for told in merge_online(merger, network, choice, Names(frame, out_topic), until=is_over):
            if isinstance(told, Moment):
                first = told.now if first is None else first
                _tell(told.now - start, told.state.events)
                yield told
            else:
                _tell(told[0] - start, (told[1],))
    except KeyboardInterrupt:
        typer.echo("mapquilt: interrupted; the last merge follows", err=True)


def _tell(seconds: float, events: Sequence[str]) -> None:
    """Print what has changed, and when."""
    for event in events:
        typer.echo(f"{seconds:8.1f} s  {printable(event)}")


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
