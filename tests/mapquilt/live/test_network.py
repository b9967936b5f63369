"""Topics of the network, on the loopback interface: processes that know of one another by DDS alone."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.io.map_file import load_map
from mapquilt.live.live_extra import live_extra, ros_domain
from tests.conftest import command
from tests.mapquilt.live.floors import explored, floor

pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")

from mapquilt.convert.ros_bag import scan_messages
from mapquilt.convert.ros_messages import occupancy_grid
from mapquilt.live.dds_types import STORE, idl_type
from mapquilt.live.live_merger import LiveMerger
from mapquilt.live.network import LATCHED, STREAM, Network, Quality
from mapquilt.live.published import published
from mapquilt.runs.robot import load_run_robots
from tests.mapquilt.live.floors import message as map_of
from tests.mapquilt.live.test_live_merger import sent as growing

GRID = "nav_msgs/msg/OccupancyGrid"
LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>'
    '<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
    "</Domain></CycloneDDS>"
)
WORLD = floor()
DOMAIN = 100 + os.getpid() % 100
"""So that the workers of one machine do not hear one another."""


@pytest.fixture(scope="module")
def network() -> Iterator[Network]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        yield Network(DOMAIN)


def start(*arguments: object) -> subprocess.Popen[str]:
    """Start the command line in a process of its own, on the loopback interface."""
    words = [sys.executable, "-m", "mapquilt", *map(str, arguments), "--domain", str(DOMAIN)]
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)


def wait_for(found: Callable[[], Any], seconds: float = 60.0) -> Any:
    """Return the first result that is not empty; None if there is none in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if result := found():
            return result
        time.sleep(0.05)
    return None


def publisher(network: Network, topic: str) -> bool:
    return any(each.topic == topic for each in network.publishers().values())


def test_dds_reads_each_message_as_ros_defines_it(close_run):
    """The bytes of rosbags, decoded by cyclonedds with the types that are made of the definitions."""
    robot = load_run_robots(close_run)[0]
    merger = LiveMerger()
    state = merger.update([map_of(WORLD, "a"), map_of(explored(WORLD, 1.0, 9.0), "b")], 5.0)
    messages = [*scan_messages(robot, 3), *published(state, 5.0), ("/map", occupancy_grid(WORLD, 1.0, "map"))]
    assert {each.__msgtype__.split("/")[2] for _, each in messages} >= {"TFMessage", "OccupancyGrid", "DiagnosticArray"}
    for _, each in messages:
        kind = each.__msgtype__
        data = bytes(STORE.serialize_cdr(each, kind))
        assert idl_type(kind).deserialize(data).serialize(use_version_2=False).rstrip(b"\0") == data.rstrip(b"\0"), kind


@pytest.mark.slow
def test_a_team_that_plays_is_merged_by_another_process(network, close_run, tmp_path):
    live = start("live", "--discover", "/robot_*/map", "--duration", 60, "--record", tmp_path / "record")
    assert wait_for(lambda: publisher(network, "/mapquilt/diagnostics"))
    play = start("play", close_run, "--poses", "odometry", "--speed", 4)
    assert play.wait(timeout=120) == 0, play.stdout.read()
    late = network.subscribe("/map_merged", GRID, LATCHED)
    static = network.subscribe("/tf_static", "tf2_msgs/msg/TFMessage", LATCHED)
    (merged,) = wait_for(lambda: list(late.take()))
    frames = {one.child_frame_id for each in wait_for(lambda: list(static.take())) for one in each.transforms}
    assert frames & {"robot_0/map", "robot_1/map"}
    output, _ = live.communicate(timeout=120)
    assert live.returncode == 0, output
    assert "2 of 2 robots joined" in output
    held = load_map(tmp_path / "record" / "merged.yaml").grid
    cells = np.array(merged.data).reshape(merged.info.height, merged.info.width)
    np.testing.assert_array_equal(cells, held.occupancy())


ROS_PYTHONS = dict(each.split("=", 1) for each in os.environ.get("MAPQUILT_ROS_PYTHONS", "").split())
"""Interpreters with rclpy, by distribution: ``kilted=/path/python jazzy=/path/python``."""


@pytest.mark.slow
@pytest.mark.parametrize("distribution", ["jazzy", "kilted"])
def test_a_real_node_is_heard_and_hears_late_what_the_file_has(distribution, tmp_path):
    if distribution not in ROS_PYTHONS:
        pytest.skip(f"MAPQUILT_ROS_PYTHONS names no {distribution}=PYTHON with ros-rclpy, as .ci/run installs it")
    maps = {}
    for robot in ("robot_0", "robot_1"):
        sent = growing(robot, 12)
        maps[robot] = sent.cells.reshape(sent.height, sent.width)
        maps[f"{robot}_origin"] = np.array([sent.resolution, *sent.origin[:2]])
    np.savez(tmp_path / "maps.npz", **maps)
    live = start("live", "--discover", "/robot_*/map", "--duration", 45, "--record", tmp_path / "record")
    node = Path(__file__).with_name("rclpy_node.py")
    words = [ROS_PYTHONS[distribution], node, tmp_path / "maps.npz", tmp_path / "received.npz", 30]
    ros = {
        "ROS_DOMAIN_ID": str(DOMAIN),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_LOG_DIR": str(tmp_path),
        "HOME": str(tmp_path),
        "PATH": os.environ["PATH"],
    }
    subprocess.run([str(each) for each in words], env=ros, check=True, timeout=120)
    output, _ = live.communicate(timeout=120)
    assert "2 of 2 robots joined" in output
    received = np.load(tmp_path / "received.npz")
    assert received["frame"] == "map_merged"
    np.testing.assert_array_equal(received["cells"], load_map(tmp_path / "record" / "merged.yaml").grid.occupancy())


@pytest.mark.slow
def test_weak_publishers_and_garbage_are_heard_and_told(network):
    live = start("live", "--topic", "/weak/map", "--topic", "/bad/map", "--duration", 12)
    grid = explored(WORLD, 1.0, 9.0)
    bad = occupancy_grid(grid, 1.0, "bad/map")
    bad.info.resolution = math.nan
    for _ in range(20):
        network.publish("/weak/map", occupancy_grid(grid, 1.0, "weak/map"), Quality(reliable=False, latched=False))
        network.publish("/bad/map", bad, STREAM)
        time.sleep(0.5)
    output, _ = live.communicate(timeout=60)
    assert live.returncode == 1, output
    assert "/weak/map: heard as best effort, volatile" in output
    assert "weak: heard for the first time" in output
    assert "bad: resolution is nan, must be finite; the message is ignored" in output
    assert "0 of 2 robots joined" in output


def test_wrong_options_are_named(capsys, tmp_path):
    assert command("live") == 2
    assert "--topic, --discover or --from: one is needed" in capsys.readouterr().err
    assert command("live", "--topic", "/a/map", "--out", tmp_path / "bag") == 2
    assert "goes with --from" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["-1", "233", "abc"])
def test_a_wrong_domain_of_ros_is_named(text, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ValueError, match=f"ROS_DOMAIN_ID is {text}, must be a number from 0 to 232"):
        ros_domain(None)
    assert ros_domain(7) == 7


def test_a_missing_package_is_named_with_its_remedy():
    with pytest.raises(ImportError, match=r"cyclonedds: pip install mapquilt\[live\]"), live_extra():
        raise ModuleNotFoundError(name="cyclonedds.sub")
