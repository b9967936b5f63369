"""A live merge of the maps that nodes of rclpy send, on the loopback interface, with Jazzy and Kilted."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapping.io.map_file import load_map

pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")

from mapquilt.evaluation.transform_error import RIGHT, transform_error
from mapquilt.live.bag_maps import map_message, yaw_of
from mapquilt.live.received_map import MapMessage, grid_of
from mapquilt.live.ros2.network import Network
from mapquilt.live.simulated_team import start_poses, team_messages
from mapquilt.runs.robot import RunRobot, load_run_robots
from tests.conftest import command
from tests.mapquilt.live.processes import Diagnostics, Process, Processes, transforms, wait_for

ROS_PYTHONS = dict(each.split("=", 1) for each in os.environ.get("MAPQUILT_ROS_PYTHONS", "").split())
"""Interpreters with rclpy, by distribution: ``kilted=/path/python jazzy=/path/python``."""
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not ROS_PYTHONS,
        reason="MAPQUILT_ROS_PYTHONS names no DISTRIBUTION=PYTHON with ros-rclpy, as .ci/run installs it",
    ),
]


@pytest.fixture(scope="module")
def team(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunRobot, ...]:
    """Four robots that start anywhere in a house and do not know where."""
    run = tmp_path_factory.mktemp("runs") / "house"
    assert command("simulate", "house", "--robots", 4, "--duration", 36, "--seed", 3, "--out", run) == 0
    return load_run_robots(run)


@pytest.fixture(scope="module")
def maps(team: tuple[RunRobot, ...]) -> list[MapMessage]:
    """The maps that they send, every 2 s of simulated time, in the order of their time."""
    sent = team_messages(team, start_poses(team))
    return [map_message(topic.split("/")[1], each) for topic, each, _ in sent if topic.endswith("/map")]


def written(maps: list[MapMessage], path: Path) -> list[str]:
    """Write maps for the nodes, and return their keys."""
    content: dict[str, np.ndarray] = {}
    for number, each in enumerate(maps):
        key = f"{each.robot}:{number}"
        content |= {key: each.cells.reshape(each.height, each.width)}
        content |= {f"{key}:place": np.array([each.resolution, *each.origin[:2]])}
    np.savez(path, **content)
    return [f"{each.robot}:{number}" for number, each in enumerate(maps)]


@pytest.fixture
def nodes(processes: Processes, maps: list[MapMessage], tmp_path: Path) -> Iterator[dict[str, Process]]:
    """A node for each robot's maps, of one distribution after the other."""
    written(maps, tmp_path / "maps.npz")
    script = Path(__file__).with_name("rclpy_node.py")
    made = [processes.node(each, script, tmp_path / "maps.npz", tmp_path) for each in ROS_PYTHONS.values()]
    yield dict(zip(sorted({each.robot for each in maps}), cycle(made), strict=False))
    for node in made:
        node.close()
        assert node.end(None) == 0, node.output


def test_four_robots_of_two_distributions_join_at_their_true_poses(
    network: Network, processes: Processes, team: tuple[RunRobot, ...], maps: list[MapMessage], nodes, tmp_path: Path
) -> None:
    """Time is compressed: a map is sent as soon as the one before was merged, as the diagnostics say."""
    ros = {"CYCLONEDDS_URI": "", "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}  # as the nodes have it
    live = processes.command("live", "--discover", "/robot_*/map", "--record", tmp_path / "record", **ros)
    diagnostics = Diagnostics(network)
    for number, each in enumerate(maps):
        nodes[each.robot].tell(f"send {each.robot}:{number}")
        known = str(np.count_nonzero(grid_of(each).known))
        assert wait_for(lambda robot=each.robot, known=known: diagnostics.value(robot, "known_cells") == known), (
            live.output
        )
    assert {diagnostics.value(robot.name, "state") for robot in team} == {"joined"}, live.output

    last = {each.robot: grid_of(each) for each in maps}
    placed = {
        name.removesuffix("/map"): Similarity2(
            one.transform.translation.x, one.transform.translation.y, yaw_of(one.transform.rotation)
        )
        for name, one in transforms(network).items()
    }
    assert set(placed) == set(last)
    starts = {robot.name: Similarity2.from_se2(robot.world_from_base.pose(0)) for robot in team}
    for name in placed.keys() - {"robot_0"}:
        answer = placed["robot_0"].inverse() @ placed[name]
        truth = starts["robot_0"].inverse() @ starts[name]
        error = transform_error(last["robot_0"], last[name], truth, answer)
        assert RIGHT.holds(error), f"{name}: {error}"

    for name, node in nodes.items():  # late, so that the merged map must be latched
        node.tell("listen /map_merged")
        node.tell(f"save {tmp_path / name}.npz")
    assert live.end() == 0
    merged = load_map(tmp_path / "record" / "merged.yaml").grid.occupancy()
    for name in nodes:
        received = np.load(tmp_path / f"{name}.npz")
        assert received["frame"] == "map_merged"
        np.testing.assert_array_equal(received["cells"], merged)
