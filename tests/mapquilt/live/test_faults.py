"""Robots and mergers that die, come back, or send garbage, in processes of their own: all goes on, and all is told."""

from __future__ import annotations

import math
import signal
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapping.io.map_file import load_map
from tests.mapquilt.live.floors import explored, floor
from tests.mapquilt.live.test_live_merger import sent

pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")

from rosbags.typesys.stores import ros2_humble as ros

from mapquilt.convert.ros_messages import occupancy_grid
from mapquilt.live.received_map import grid_of
from mapquilt.live.ros2.dds_types import STORE, cdr_type
from mapquilt.live.ros2.network import LATCHED, STREAM, Network, decoded
from tests.mapquilt.live.processes import GRID, Diagnostics, Process, Processes, transforms, wait_for

WORLD = floor()
TEAM = ("robot_0", "robot_1")


def publish(network: Network, robot: str, step: int) -> None:
    """Send the map that a robot has after some steps."""
    message = sent(robot, step)
    network.publish(f"/{robot}/map", occupancy_grid(grid_of(message), step, message.frame), LATCHED)


def wait_until_merged(live: Process, diagnostics: Diagnostics, robot: str, step: int, *frame: float) -> None:
    """Wait until the diagnostics count the cells of that map."""
    known = str(np.count_nonzero(grid_of(sent(robot, step, Similarity2(*frame) if frame else None)).known))
    assert wait_for(lambda: diagnostics.value(robot, "known_cells") == known), live.output


def explore(network: Network, live: Process, diagnostics: Diagnostics, steps: range) -> None:
    """Let two robots explore, each step once the last one was merged."""
    for step in steps:
        for robot in TEAM:
            publish(network, robot, step)
            wait_until_merged(live, diagnostics, robot, step)


@pytest.fixture
def team(network: Network):
    """Forget the maps that the robots of the test before have latched."""
    yield
    for robot in TEAM:
        network.withdraw(f"/{robot}/map")


@pytest.mark.slow
def test_a_robot_that_is_killed_falls_silent_and_joins_anew_when_it_is_back(network, processes: Processes):
    live = processes.command("live", "--discover", "/robot_*/map", "--set", "silent_after=4")
    diagnostics = Diagnostics(network)
    first, second = processes.dds_node(), processes.dds_node()
    for step in range(6, 12):
        for node, robot in ((first, "robot_0"), (second, "robot_1")):
            node.tell(f"send {robot} {step}")
            wait_until_merged(live, diagnostics, robot, step)
    assert live.says("robot_0: joined", "robot_1: joined"), live.output
    second.end(signal.SIGKILL)
    assert live.says("robot_1: silent for 4 s; its last map stays"), live.output
    assert live.says("/robot_1/map: its publisher has gone; the last map stays"), live.output
    assert diagnostics.look()["robot_1"][0].startswith("silent for")
    assert diagnostics.value("robot_1", "state") == "joined"

    again = processes.dds_node()
    for step in range(6, 12):
        again.tell(f"send robot_1 {step} 1.0 6.0 -1.2")
        wait_until_merged(live, diagnostics, "robot_1", step, 1.0, 6.0, -1.2)
        assert live.says("robot_1: restarted: its map keeps"), live.output
        first.tell(f"send robot_0 {step + 6}")
        wait_until_merged(live, diagnostics, "robot_0", step + 6)
    told = ("robot_1: left: restarted", "/robot_1/map: a publisher is back", "robot_1: heard again")
    assert live.says(*told), live.output
    assert wait_for(lambda: live.output.count("robot_1: joined") == 2), live.output
    assert live.end() == 0, live.output


@pytest.mark.slow
def test_a_merger_that_is_killed_is_replaced_by_a_new_one(network, processes: Processes, team, tmp_path: Path):
    options = ("live", "--discover", "/robot_*/map", "--record", tmp_path / "record")
    diagnostics = Diagnostics(network)
    killed = processes.command(*options)
    explore(network, killed, diagnostics, range(6, 10))
    assert killed.says("robot_0: joined", "robot_1: joined"), killed.output
    killed.send(signal.SIGUSR1)
    assert killed.says("recorded: "), killed.output
    before = load_map(tmp_path / "record" / "merged.yaml").grid
    killed.send(signal.SIGUSR1)
    killed.end(signal.SIGKILL)  # perhaps while it writes
    assert np.array_equal(load_map(tmp_path / "record" / "merged.yaml").grid.log_odds, before.log_odds)

    live = processes.command(*options, "--set", "still_after=1")  # robots stand still, and their maps are latched
    assert live.says("robot_0: joined", "robot_1: joined"), live.output
    explore(network, live, diagnostics, range(10, 12))
    assert set(transforms(network)) == {"robot_0/map", "robot_1/map"}
    assert live.end(signal.SIGTERM) == 0, live.output
    assert np.count_nonzero(load_map(tmp_path / "record" / "merged.yaml").grid.known) > np.count_nonzero(before.known)


@pytest.mark.slow
def test_two_mergers_hear_of_one_another(processes: Processes):
    one = processes.command("live", "--discover", "/robot_*/map")
    other = processes.command("live", "--discover", "/robot_*/map", "--namespace", "fleet")
    text = "another live merge is on the network, and both send tf; stop one of them"
    assert one.says(f"/fleet/mapquilt/diagnostics: {text}"), one.output
    assert other.says(f"/mapquilt/diagnostics: {text}"), other.output
    assert other.end() == 1
    assert one.says("/fleet/mapquilt/diagnostics: the other live merge has gone"), one.output
    assert one.end() == 1


def test_bytes_that_are_no_message_are_refused():
    """Damaged messages, and noise: each is decoded or refused, and none raises."""
    whole = bytes(STORE.serialize_cdr(occupancy_grid(explored(WORLD, 1.0, 2.0), 1.0, "map"), GRID))
    rng, refused = np.random.default_rng(3), 0
    for _ in range(3000):
        data = bytearray(whole[: int(rng.integers(len(whole)))] if rng.random() < 0.5 else whole)
        for place in rng.integers(len(data) or 1, size=int(rng.integers(1, 6))) if data else ():
            data[place % min(len(data), 120)] = int(rng.integers(256))
        refused += decoded(bytes(data), GRID) is None
    assert 1000 < refused < 3000
    assert decoded(whole, GRID) is not None


@pytest.mark.slow
def test_garbage_of_every_kind_is_told_and_ignored(network: Network, processes: Processes, team):
    live = processes.command("live", "--discover", "/robot_*/map")
    diagnostics = Diagnostics(network)
    explore(network, live, diagnostics, range(6, 10))
    assert live.says("robot_0: joined", "robot_1: joined"), live.output
    network.publish("/robot_2/map", ros.std_msgs__msg__Bool(True), STREAM)
    network.publish("/robot_3/../map", occupancy_grid(WORLD, 1.0, "map"), LATCHED)
    network.publish("/robot_4/map_updates", occupancy_grid(WORLD, 1.0, "map"), LATCHED)
    nan = occupancy_grid(WORLD, 1.0, "map")
    nan.info.origin.position.x = math.nan
    network.publish("/robot_5/map", nan, LATCHED)
    writer = network.writer("/robot_6/map", GRID, STREAM)
    no_text = bytes(STORE.serialize_cdr(occupancy_grid(WORLD, 1.0, "no text"), GRID)).replace(b"no text", b"\xff" * 7)
    told = (
        "/robot_2/map: sends std_msgs/msg/Bool, must be nav_msgs/msg/OccupancyGrid; it is ignored",
        "/robot_3/../map: is no name of a ROS topic; it is ignored",
        "robot_5: origin x is nan, must be finite; the message is ignored",
        "/robot_6/map: a message cannot be decoded; it is ignored",
    )

    def is_told() -> bool:
        sample = cdr_type(GRID)()
        sample.cdr = no_text
        writer.write(sample)
        return live.says(*told, seconds=0.5)

    assert wait_for(is_told), live.output
    explore(network, live, diagnostics, range(10, 11))
    assert {diagnostics.value(robot, "state") for robot in TEAM} == {"joined"}
    for topic in ("/robot_2/map", "/robot_3/../map", "/robot_4/map_updates", "/robot_5/map", "/robot_6/map"):
        network.withdraw(topic)
    assert live.end() == 1, live.output
    assert "2 of 3 robots joined" in live.output


@pytest.mark.slow
def test_twenty_robots_are_heard_and_merged(network: Network, processes: Processes):
    """Their 190 pairs are matched in turn, also while no map comes; no update waits for all of them."""
    live = processes.command("live", "--discover", "/crowd_*/map")
    diagnostics = Diagnostics(network)
    robots = [f"crowd_{k}" for k in range(20)]
    assert wait_for(lambda: diagnostics.look()), live.output

    def updates() -> int:
        return int(diagnostics.value("merged map", "updates") or 0)

    for step in range(6):
        for k, robot in enumerate(robots):
            grid = explored(WORLD, 0.5 * k, 0.5 * k + 6.0 + 0.5 * step)
            network.publish(f"/{robot}/map", occupancy_grid(grid, step, f"{robot}/map"), LATCHED)
        turn = updates()
        assert wait_for(lambda turn=turn: updates() > turn), live.output
    assert wait_for(lambda: set(robots) <= set(diagnostics.look())), live.output
    assert wait_for(lambda: int(diagnostics.value("merged map", "joined")) >= 2), live.output
    assert wait_for(lambda: sum("<-" in name for name in diagnostics.look()) > updates() + 5), live.output
    for robot in robots:
        network.withdraw(f"/{robot}/map")
    assert live.end() in (0, 1), live.output
    assert "of 20 robots joined" in live.output
    assert "Traceback" not in live.output


@pytest.mark.slow
def test_a_merger_is_frozen_and_recorded_while_it_runs(network: Network, processes: Processes, team, tmp_path: Path):
    live = processes.command("live", "--discover", "/robot_*/map", "--freeze", "--record", tmp_path / "record")
    diagnostics = Diagnostics(network)
    assert live.says("frozen: all poses are held"), live.output
    ask = ros.std_msgs__msg__Empty(0)
    assert wait_for(
        lambda: network.publish("/mapquilt/record", ask) or live.says("no record: no usable map", seconds=1)
    )
    explore(network, live, diagnostics, range(6, 10))
    assert diagnostics.look()["merged map"][0] == "0 of 2 robots joined, frozen"
    live.send(signal.SIGUSR2)
    assert live.says("not frozen: poses follow the maps"), live.output
    explore(network, live, diagnostics, range(10, 14))
    assert diagnostics.look()["merged map"][0] == "2 of 2 robots joined"
    network.publish("/mapquilt/record", ask)
    assert live.says("recorded: "), live.output
    assert (tmp_path / "record" / "merged.yaml").exists()
    hold = ros.std_msgs__msg__Bool(True)
    again = "frozen: all poses are held"
    assert wait_for(lambda: network.publish("/mapquilt/freeze", hold) or live.output.count(again) == 2), live.output
    assert live.end() == 0, live.output


@pytest.mark.slow
def test_no_robot_at_all_is_told_at_the_end(processes: Processes, tmp_path: Path):
    live = processes.command("live", "--topic", "/robot_0/map", "--duration", 1, "--record", tmp_path / "record")
    assert live.end(None) == 1, live.output
    assert "0 of 0 robots joined" in live.output
    assert f"{tmp_path / 'record'}: not written; no usable map came" in live.output
    assert not (tmp_path / "record").exists()


@pytest.mark.slow
def test_maps_that_nobody_asked_for_are_named_if_no_other_is_heard(network: Network, processes: Processes):
    live = processes.command("live", "--topic", "/robot_0/map", ROS_LOCALHOST_ONLY="1", CYCLONEDDS_URI="")
    assert live.says("no map on the network yet; check --domain, ROS_DOMAIN_ID and CYCLONEDDS_URI"), live.output
    network.publish("/tb3/map", occupancy_grid(WORLD, 1.0, "map"), LATCHED)
    other = processes.command("live", "--topic", "/robot_0/map")
    assert other.says("no map on the topics that are wanted; maps are on /tb3/map"), other.output
    network.withdraw("/tb3/map")
    assert (live.end(), other.end()) == (1, 1)


@pytest.mark.slow
def test_simulated_time_stamps_what_is_published(network: Network, processes: Processes, team):
    """The clock runs a hundred times too fast, so that a robot falls silent at once."""
    live = processes.command("live", "--discover", "/robot_*/map", "--use-sim-time")
    diagnostics = Diagnostics(network)
    assert live.says("/clock: nothing heard yet; waits for the simulated time"), live.output
    time = ros.builtin_interfaces__msg__Time

    def tick(seconds: int) -> None:
        network.publish("/clock", ros.rosgraph_msgs__msg__Clock(time(seconds, 500_000_000)))

    publish(network, "robot_0", 8)
    assert wait_for(lambda: tick(7000) or live.says("robot_0: heard for the first time", seconds=0.5)), live.output
    assert wait_for(lambda: diagnostics.look() and diagnostics.stamp == 7000.5)
    assert wait_for(lambda: tick(7100) or live.says("robot_0: silent for 100 s", seconds=0.5)), live.output
    assert wait_for(lambda: tick(6900) or live.says("time went back by 200.0 s", seconds=0.5)), live.output
    assert live.end() == 1, live.output
