"""A run played to a bag, merged live from it, and what was published read back: round trips and refusals."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.stores import ros1_noetic as ros1
from rosbags.typesys.stores import ros2_humble as ros

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import map_log
from mapping.io.map_file import load_map
from mapquilt.convert.ros_messages import occupancy_grid, ros_nanoseconds
from mapquilt.live.bag_maps import bag_maps, map_message, yaw_of
from mapquilt.live.received_map import MapPatch
from mapquilt.live.simulated_team import start_poses, team_messages
from mapquilt.live.topics import TopicChoice, robot_names
from mapquilt.runs.robot import load_run_robots
from tests.conftest import command, hashes
from tests.mapquilt.live.floors import explored, floor, message

WORLD = floor()
STORE = get_typestore(Stores.ROS2_HUMBLE)

Messages = dict[str, list[tuple[int, Any]]]


def read(bag: Path) -> Messages:
    messages: Messages = {}
    with AnyReader([bag], default_typestore=STORE) as reader:
        for connection, time, data in reader.messages():
            messages.setdefault(connection.topic, []).append((time, reader.deserialize(data, connection.msgtype)))
    return messages


@pytest.fixture(scope="module")
def team(close_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("play") / "team"
    assert command("play", close_run, "--out", folder, "--poses", "odometry") == 0
    return folder


@pytest.fixture(scope="module")
def results(team: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("live")
    out, record = folder / "published", folder / "record"
    assert command("live", "--from", team, "--out", out, "--record", record) == 0
    return out, record


def test_a_played_map_is_that_of_the_scans_so_far(close_run, team):
    messages = read(team)
    for robot in load_run_robots(close_run):
        (poses,) = start_poses([robot], "odometry")
        sent = messages[f"/{robot.name}/map"]
        expected = occupancy_grid(map_log(robot.log, poses), robot.log.scans[-1].stamp, f"{robot.name}/map")
        np.testing.assert_array_equal(sent[-1][1].data, expected.data)
        sizes = [np.count_nonzero(each.data >= 0) for _, each in sent]
        assert sizes == sorted(sizes)
        assert len(sent) >= 6


def test_a_map_is_drawn_anew_when_slam_has_moved_its_poses(close_run):
    """As if a loop had closed at scan 90: all poses before lie elsewhere from then on."""
    (robot, *_) = load_run_robots(close_run)
    (poses,) = start_poses([robot], "odometry")
    moved = poses.moved(SE2(0.4, -0.3, 0.1))
    believed = [(moved if k >= 90 else poses).poses[: k + 1] for k in range(len(poses))]
    sent = team_messages([robot], [believed])
    maps = [(nanoseconds, each) for topic, each, nanoseconds in sent if topic.endswith("/map")]
    stamps = [ros_nanoseconds(scan.stamp) for scan in robot.log.scans]
    for nanoseconds, each in maps:
        scans = stamps.index(nanoseconds) + 1
        path, log = (moved if scans > 90 else poses).part(0, scans), robot.log.part(0, scans)
        expected = occupancy_grid(map_log(log, path), log.scans[-1].stamp, f"{robot.name}/map")
        np.testing.assert_array_equal(each.data, expected.data)
        assert each.info == expected.info
    assert {stamps.index(nanoseconds) >= 90 for nanoseconds, _ in maps} == {True, False}


def test_tf_leads_from_the_map_to_the_lidar_at_every_scan(close_run, team):
    messages = read(team)
    latest: dict[str, SE2] = {}
    placed: dict[int, dict[str, SE2]] = {}
    for time, each in messages["/tf"]:
        for one in each.transforms:
            move = one.transform.translation
            latest[one.child_frame_id] = SE2(move.x, move.y, yaw_of(one.transform.rotation))
            placed[time] = dict(latest)
    for robot in load_run_robots(close_run):
        (poses,) = start_poses([robot], "odometry")
        scans = messages[f"/{robot.name}/scan"]
        assert len(scans) == len(robot.log.scans)
        for k in (0, len(scans) - 1):
            frames = placed[scans[k][0]]
            found = frames[f"{robot.name}/odom"] @ frames[f"{robot.name}/base_link"]
            expected = poses.pose(k)
            assert math.hypot(found.x - expected.x, found.y - expected.y) < 1e-9
    clock = [each.clock.sec + 1e-9 * each.clock.nanosec for _, each in messages["/clock"]]
    assert clock == sorted(set(clock))


def test_what_is_published_last_is_what_is_recorded(results):
    out, record = results
    messages = read(out)
    merged = messages["/map_merged"][-1][1]
    held = load_map(record / "merged.yaml").grid
    info = merged.info
    np.testing.assert_array_equal(np.array(merged.data).reshape(info.height, info.width), held.occupancy())
    assert held.frame.metres_from_cells([(0, 0)])[0] - 0.5 * held.frame.resolution == pytest.approx(
        [info.origin.position.x, info.origin.position.y]
    )
    recorded = json.loads((record / "merge.json").read_text())
    poses = {each["name"]: each["reference_from_map"] for each in recorded["groups"][0]["maps"]}
    last = {one.child_frame_id: one for _, each in messages["/tf"] for one in each.transforms}
    assert len(poses) == 2
    for name, pose in poses.items():
        if name == recorded["reference"]:
            (static,) = messages["/tf_static"][-1][1].transforms
            assert static.header.frame_id == "map_merged"
            assert static.child_frame_id == f"{name}/map"
            assert static.transform.rotation.w == 1.0
            continue
        one = last[f"{name}/map"]
        assert (one.transform.translation.x, one.transform.translation.y) == pytest.approx((pose["x"], pose["y"]))
        assert yaw_of(one.transform.rotation) == pytest.approx(pose["yaw"])


def test_diagnostics_name_every_robot_and_pair(results):
    out, _ = results
    last = read(out)["/mapquilt/diagnostics"][-1][1]
    status = {each.name: each for each in last.status}
    names = ("merged map", "robot_0", "robot_1", "robot_0 <- robot_1")
    assert set(status) == {f"mapquilt: {name}" for name in names}
    assert status["mapquilt: merged map"].message == "2 of 2 robots joined"
    values = {each.key: each.value for each in status["mapquilt: robot_0 <- robot_1"].values}
    assert values["verdict"] == "accepted"


def test_the_same_bag_gives_the_same_bytes(team, results, tmp_path):
    out, record = results
    command("live", "--from", team, "--out", tmp_path / "published", "--record", tmp_path / "record")
    assert hashes(tmp_path / "published") == hashes(out)
    assert hashes(tmp_path / "record") == hashes(record)


def test_a_recorded_merge_can_be_extended(results, close_run, tmp_path):
    _, record = results
    extended = Path(shutil.copytree(record, tmp_path / "record"))
    assert command("merge", extended, "--add", extended / "inputs" / "1" / "robot_1.yaml") == 0


def test_a_frozen_replay_moves_nothing(team, tmp_path):
    assert command("live", "--from", team, "--out", tmp_path / "bag", "--freeze-after", 0.0) == 1
    assert "/tf" not in read(tmp_path / "bag")
    assert command("live", "--from", team, "--out", tmp_path / "frozen", "--freeze") == 1
    messages = read(tmp_path / "frozen")
    assert "/tf" not in messages
    assert messages["/mapquilt/diagnostics"][-1][1].status[0].message == "0 of 2 robots joined, frozen"


def test_topics_lie_in_the_namespace_and_settings_are_heeded(team, tmp_path):
    """With 99 confirmations, which never come, only the map that holds the frame is joined."""
    options = ("--namespace", "site/fleet", "--set", "placement.confirmations=99")
    assert command("live", "--from", team, "--out", tmp_path / "bag", *options) == 1
    messages = read(tmp_path / "bag")
    assert set(messages) == {
        "/site/fleet/map_merged",
        "/site/fleet/mapquilt/conflicts",
        "/site/fleet/mapquilt/diagnostics",
        "/tf_static",
    }


def write_bag(path: Path, ending: str) -> Path:
    """A bag of one robot: a map, and an update of it."""
    grid = explored(WORLD, 2.0, 6.0)
    header = ros.std_msgs__msg__Header(ros.builtin_interfaces__msg__Time(5, 0), "robot_0/map")
    patch = np.full(6, 100, np.int8)
    definition = get_types_from_msg(
        "std_msgs/Header header\nint32 x\nint32 y\nuint32 width\nuint32 height\nint8[] data\n",
        "map_msgs/msg/OccupancyGridUpdate",
    )
    store = get_typestore(Stores.ROS1_NOETIC if ending == ".bag" else Stores.ROS2_HUMBLE)
    store.register(definition)
    sent = occupancy_grid(grid, 4.0, "robot_0/map")
    if ending == ".bag":
        header = ros1.std_msgs__msg__Header(0, ros1.builtin_interfaces__msg__Time(5, 0), "robot_0/map")
        place = ros1.geometry_msgs__msg__Pose(
            ros1.geometry_msgs__msg__Point(grid.frame.origin.x, grid.frame.origin.y, 0.0),
            ros1.geometry_msgs__msg__Quaternion(0.0, 0.0, 0.0, 1.0),
        )
        rows, cols = grid.frame.shape
        info = ros1.nav_msgs__msg__MapMetaData(ros1.builtin_interfaces__msg__Time(5, 0), 0.05, cols, rows, place)
        sent = ros1.nav_msgs__msg__OccupancyGrid(header, info, sent.data)
        writer = Ros1Writer(path)
        serialize = store.serialize_ros1
    else:
        plugin = StoragePlugin.MCAP if ending == ".mcap" else StoragePlugin.SQLITE3
        writer = Ros2Writer(path, version=8, storage_plugin=plugin)
        serialize = store.serialize_cdr
    kind = "map_msgs/msg/OccupancyGridUpdate"
    update = store.types[kind](header=header, x=1, y=2, width=3, height=2, data=patch)
    with writer:
        for topic, one in (("/robot_0/map", sent), ("/robot_0/map_updates", update)):
            connection = writer.add_connection(topic, one.__msgtype__, typestore=store)
            writer.write(connection, 5_000_000_000, serialize(one, one.__msgtype__))
    return path if path.is_file() else next(path.glob(f"*{ending}"))


@pytest.mark.parametrize("ending", [".mcap", ".db3", ".bag"])
def test_maps_and_updates_are_read_from_every_kind_of_bag(ending, tmp_path):
    path = write_bag(tmp_path / (f"team{ending}" if ending == ".bag" else "team"), ending)
    (_, first), (_, second) = bag_maps(path)
    expected = message(explored(WORLD, 2.0, 6.0))
    np.testing.assert_array_equal(first.cells, expected.cells)
    assert first.origin == pytest.approx(expected.origin)
    assert (first.robot, first.frame, first.width) == ("robot_0", "robot_0/map", expected.width)
    assert isinstance(second, MapPatch)
    assert (second.x, second.y, second.width, second.height, second.cells.sum()) == (1, 2, 3, 2, 600)


def test_a_message_keeps_the_yaw_of_its_origin():
    grid = WORLD.frame.__class__(0.05, SE2(1.0, -2.0, 2.5), WORLD.frame.shape)
    sent = occupancy_grid(WORLD.__class__(grid, WORLD.log_odds), 1.0, "map")
    assert map_message("robot_0", sent).origin == pytest.approx((1.0, -2.0, 2.5))


def test_robots_are_named_after_their_namespaces():
    assert robot_names(["/robot_0/map", "/fleet/b/map"]) == {"/robot_0/map": "robot_0", "/fleet/b/map": "fleet_b"}
    assert robot_names(["/map"]) == {"/map": "map"}
    assert robot_names(["/a/map", "/a/plan"], {"/a/map": "a"}) == {"/a/map": "a", "/a/plan": "a_plan"}
    assert robot_names(["/a/map", "/a/local_map"]) == {"/a/map": "a_map", "/a/local_map": "a_local_map"}
    assert TopicChoice(discover="/robot_*/map").takes("/robot_7/map")
    assert not TopicChoice(("/a/map",)).takes("/robot_7/map")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (("--topic", "/robot_9/map"), "no topic /robot_9/map, only the maps /robot_0/map, /robot_1/map"),
        (("--discover", "/tb*/map"), "no topic /tb*/map, only the maps /robot_0/map, /robot_1/map"),
        (("--out-topic", "merged map"), "--out-topic merged map: must be a name of a ROS topic"),
        (("--namespace", "2nd"), "--namespace 2nd: must be a name of ROS"),
        (("--frame", ""), "--frame '': must be the name of a frame"),
        (("--topic", "map"), "--topic map: must be the full name of a ROS topic"),
        (("--set", "placement.x=1"), "--set placement.x=1"),
        (("--use-sim-time",), "--use-sim-time: goes with topics of the network"),
        (("--from", "missing.mcap"), "missing.mcap"),
    ],
)
def test_wrong_options_are_named(team, options, complaint, capsys, tmp_path):
    assert command("live", "--from", team, "--out", tmp_path / "bag", *options) == 2
    assert complaint in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (("--period", 0), "--period 0: must be positive [s]"),
        (("--poses", "x"), "--poses x: must be one of online, slam, odometry"),
    ],
)
def test_wrong_options_of_play_are_named(close_run, options, complaint, capsys, tmp_path):
    assert command("play", close_run, "--out", tmp_path / "bag", *options) == 2
    assert complaint in capsys.readouterr().err


def test_a_bag_that_is_not_there_is_refused_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("live", "--from", tmp_path / "gone.mcap") == 2
    assert capsys.readouterr().err == f"mapquilt: {tmp_path / 'gone.mcap'}: no such file or folder\n"
