"""``mapquilt live``: merge the maps of running robots."""

from __future__ import annotations

import math
import time
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from signal import SIGUSR1, SIGUSR2
from statistics import median
from typing import Annotated

import typer
from rich.table import Table

from mapping.io.transaction import atomic_folder
from mapping.wording import counted
from mapquilt.cli.exit_status import ALL_MERGED, SOME_REFUSED
from mapquilt.cli.live_screen import LiveScreen, live_screen
from mapquilt.cli.options.files import path
from mapquilt.cli.signals import heeded_signals
from mapquilt.cli.tables import print_table
from mapquilt.convert.conversion import require_new_folder
from mapquilt.jobs.progress import count_progress
from mapquilt.leaves import with_assignments
from mapquilt.live.live_merger import LiveMerger, LiveState
from mapquilt.live.merge_of_state import record_merge
from mapquilt.live.robots import told_silence
from mapquilt.live.ros2.live_extra import live_extra, ros_domain
from mapquilt.live.settings import LiveSettings
from mapquilt.live.topics import Names, TopicChoice, is_ros_name
from mapquilt.logs.rosbags_extra import rosbags_extra
from mapquilt.merging.merge_folder import refuse_merge
from mapquilt.viz.text_table import plain_table


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
        typer.Option(
            "--record",
            metavar="DIR",
            parser=path,
            help="Folder for the merge, as `merge` writes it: at the end, at SIGUSR1, and at a message on "
            "/mapquilt/record.",
        ),
    ] = None,
    freeze: Annotated[
        bool,
        typer.Option(
            "--freeze", help="Hold all poses from the start. SIGUSR2 or a message on /mapquilt/freeze changes that."
        ),
    ] = False,
    freeze_after: Annotated[
        float | None, typer.Option(help="Hold all poses from so long after the first map on [s].")
    ] = None,
    frame: Annotated[str, typer.Option(help="Frame of the merged map.")] = Names.frame,
    out_topic: Annotated[
        str, typer.Option(help="Topic of the merged map; in the namespace, unless it starts with /.")
    ] = "map_merged",
    namespace: Annotated[
        str, typer.Option(help="Namespace of all that is published, but for tf: fleet gives /fleet/map_merged.")
    ] = "",
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="DDS domain; default: ROS_DOMAIN_ID, else 0.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Without --from: stop after so long [s]; default: at an interrupt.")
    ] = None,
    use_sim_time: Annotated[
        bool, typer.Option("--use-sim-time", help="Without --from: take the time of /clock, as a simulator sends it.")
    ] = False,
    changes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Any setting of the live merge by its dotted name: placement.patience=5, silent_after=30, "
            "merge.acceptance.min_overlap=0.2. Repeatable.",
        ),
    ] = None,
) -> int:
    """Merge the maps of robots in the order in which they come, without a jump of the merged map.

    A map joins once its pose is confirmed, then moves in small steps only, and leaves with a reason if new cells
    contradict its pose. Without --from, topics of the network are merged and the result is published, with no ROS
    installed (`pip install mapquilt[live]`), until an interrupt. A bag needs `pip install mapquilt[ros]`. Exit status 1
    if a robot has not joined at the end.

    Example: mapquilt live --discover '/robot_*/map' --record merged
    """
    names = Names.of(frame, out_topic, namespace)
    settings = with_assignments(LiveSettings(), "--set", changes or ())
    of_network = {"--domain": domain is not None, "--duration": duration is not None, "--use-sim-time": use_sim_time}
    _check_options(source, topic, discover, out, of_network)
    if out is not None:
        require_new_folder(out)
    if record is not None:
        refuse_merge(record, [] if source is None else [source])
    merger, choice = LiveMerger(settings, freeze), TopicChoice(topic or (), discover)
    if source is not None:
        seconds = array("d", _merge_bag(merger, source, choice, out, names, freeze_after))
    else:
        session = _Session(names, record, freeze_after, ros_domain(domain), duration, use_sim_time)
        seconds = array("d", _merge_topics(merger, choice, session))
    is_recorded = record is not None and _recorded(record, merger)
    print_table(_table(merger.state, seconds))
    if out is not None:
        typer.echo(f"written: {out}, all that was published")
    if record is not None:
        typer.echo(
            f"written: {record}, the last merge" if is_recorded else f"{record}: not written; no usable map came"
        )
    robots = merger.state.robots
    return ALL_MERGED if robots and len(merger.state.poses) == len(robots) else SOME_REFUSED


def _check_options(
    source: Path | None,
    topic: list[str] | None,
    discover: str | None,
    out: Path | None,
    of_network: Mapping[str, bool],
) -> None:
    """Raise ``ValueError`` for options that do not go together; ``of_network`` says which were given that no bag
    takes."""
    for name in topic or ():
        if not is_ros_name(name):
            raise ValueError(f"--topic {name}: must be the full name of a ROS topic, such as /robot_0/map")
    if source is None and not topic and discover is None:
        raise ValueError("--topic, --discover or --from: one is needed to say which maps to merge")
    if source is None and out is not None:
        raise ValueError(f"--out {out}: goes with --from; `ros2 bag record` records topics of the network")
    given = [option for option, is_given in of_network.items() if is_given]
    if source is not None and given:
        raise ValueError(f"{given[0]}: goes with topics of the network, not with --from")


def _recorded(record: Path, merger: LiveMerger) -> bool:
    """Write the merge of now; return False if no usable map came yet."""
    if all(robot.grid is None for robot in merger.state.robots.values()):
        return False
    record_merge(record, merger.state, merger.settings)
    return True


def _merge_bag(
    merger: LiveMerger,
    source: Path,
    choice: TopicChoice,
    out: Path | None,
    names: Names,
    freeze_after: float | None,
) -> Iterator[float]:
    """Merge a bag, tell what changes, and write what is published to a bag of its own; yield each update's time [s]."""
    with rosbags_extra():
        from mapquilt.convert.ros_bag import new_bag
        from mapquilt.live.bag_maps import bag_maps
        from mapquilt.live.replay import PublishedBag, replay
    screen = LiveScreen(merger)
    with count_progress("merging maps") as on_progress, ExitStack() as stack:
        bag, start, silent = None, None, frozenset[str]()
        if out is not None:
            writer = stack.enter_context(new_bag(stack.enter_context(atomic_folder(out))))
            bag = PublishedBag(writer, merger, names)
        for moment in replay(merger, bag_maps(source, choice, on_progress), freeze_after):
            start = moment.now if start is None else start
            silent, told = told_silence(moment.state.robots, silent, moment.now, merger.settings)
            screen.tell(moment.now - start, (*moment.state.events, *told))
            if bag is not None:
                bag.write(moment)
            yield moment.seconds
        if bag is not None:
            bag.close()


@dataclass(frozen=True)
class _Session:
    """Options of a merge of topics."""

    names: Names
    record: Path | None
    freeze_after: float | None
    domain: int
    duration: float | None
    use_sim_time: bool


def _merge_topics(merger: LiveMerger, choice: TopicChoice, session: _Session) -> Iterator[float]:
    """Merge topics of the network until a signal or the end of the time, and tell what changes; yield each update's
    time [s]."""
    with live_extra():
        from mapquilt.live.ros2.clock import SimulatedClock
        from mapquilt.live.ros2.network import Network
        from mapquilt.live.ros2.online import merge_online
    network, start = Network(session.domain), time.monotonic()
    clock = SimulatedClock(network) if session.use_sim_time else time.time
    first: float | None = None
    cycles = merge_online(merger, network, choice, session.names, clock=clock)
    with heeded_signals() as signals, live_screen(merger) as screen, closing(cycles):
        for cycle in cycles:
            elapsed = time.monotonic() - start
            events = [*cycle.events, *(cycle.moment.state.events if cycle.moment is not None else ())]
            if cycle.record or signals.take(SIGUSR1):
                events.append(_record_now(session.record, merger))
            screen.tell(elapsed, events)
            screen.show(cycle.now, None if cycle.moment is None else cycle.moment.seconds)
            if cycle.moment is not None:
                first = elapsed if first is None else first
                yield cycle.moment.seconds
            if signals.take(SIGUSR2):
                merger.frozen = not merger.frozen
            if session.freeze_after is not None and first is not None and elapsed - first >= session.freeze_after:
                merger.frozen, session = True, replace(session, freeze_after=None)
            if signals.ended or (session.duration is not None and elapsed >= session.duration):
                return


def _record_now(record: Path | None, merger: LiveMerger) -> str:
    """Write the merge while it goes on; return what to tell. A disk that fails does not end the merge."""
    if record is None:
        return "no record: --record names no folder"
    try:
        return f"recorded: {record}" if _recorded(record, merger) else "no record: no usable map came yet"
    except (OSError, ValueError) as error:
        return f"no record: {error}"


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
