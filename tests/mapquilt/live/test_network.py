"""Topics of the network, on the loopback interface: processes that know of one another by DDS alone."""

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from mapping.io.map_file import load_map
from mapquilt.live.ros2.live_extra import live_extra, ros_domain
from tests.conftest import command
from tests.mapquilt.live.floors import explored, floor

pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")

from mapquilt.convert.ros_bag import scan_messages
from mapquilt.convert.ros_messages import occupancy_grid
from mapquilt.live.live_merger import LiveMerger
from mapquilt.live.published import published
from mapquilt.live.ros2.dds_types import STORE, idl_type
from mapquilt.live.ros2.network import LATCHED, STREAM, Network, Quality, configuration
from mapquilt.live.ros2.online import OnlineSettings, merge_online
from mapquilt.live.topics import Names, TopicChoice
from mapquilt.runs.robot import load_run_robots
from tests.mapquilt.live.floors import message as map_of
from tests.mapquilt.live.processes import GRID, Diagnostics, is_published, transforms, wait_for

WORLD = floor()
publishers_of = Network.publishers


def every_publisher(network: Network):
    """The publishers of the network, ours as those of others: these tests are a single process."""
    return {key: replace(each, ours=False) for key, each in publishers_of(network).items() if "/slow_0/" in each.topic}


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
def test_a_team_that_plays_is_merged_by_another_process(network, processes, close_run, tmp_path):
    live = processes.command("live", "--discover", "/robot_*/map", "--record", tmp_path / "record")
    assert wait_for(lambda: is_published(network, "/mapquilt/diagnostics"))
    play = processes.command("play", close_run, "--poses", "odometry", "--speed", 4)
    assert live.says("robot_0: joined", "robot_1: joined"), live.output
    late = network.subscribe("/map_merged", GRID, LATCHED)
    assert play.end(None) == 0, play.output
    frames = {one.child_frame_id for one in transforms(network).values()}
    assert frames == {"robot_0/map", "robot_1/map"}
    assert live.end() == 0, live.output
    merged = list(late.take())[-1]
    assert "2 of 2 robots joined" in live.output
    held = load_map(tmp_path / "record" / "merged.yaml").grid
    cells = np.array(merged.data).reshape(merged.info.height, merged.info.width)
    np.testing.assert_array_equal(cells, held.occupancy())


def test_tf_and_diagnostics_go_on_while_an_update_takes_long(network):
    """The update ends only once two further diagnostics were heard."""
    heard = Diagnostics(network, "/slow/mapquilt/diagnostics")
    stamps = set()

    class SlowMerger(LiveMerger):
        def update(self, messages, now):
            assert wait_for(lambda: (heard.look() and stamps.add(heard.stamp)) or len(stamps) > 2, 20.0)
            return super().update(messages, now)

    network.publish("/slow_0/map", occupancy_grid(explored(WORLD, 1.0, 9.0), 1.0, "map"), LATCHED)
    names, settings = Names.of("map_merged", "map_merged", "slow"), OnlineSettings(heartbeat=0.05)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Network, "publishers", every_publisher)
        cycles = merge_online(SlowMerger(), network, TopicChoice(("/slow_0/map",)), names, settings=settings)
        with closing(cycles):
            updated = next(cycle for cycle in cycles if cycle.moment is not None)
    network.withdraw("/slow_0/map")
    assert "slow_0: heard for the first time" in updated.moment.state.events


def test_an_error_of_the_heartbeat_ends_the_merge(network, monkeypatch):
    def fail(*arguments):
        raise ValueError("/tf: no network")

    cycles = merge_online(LiveMerger(), network, TopicChoice(("/gone/map",)))
    monkeypatch.setattr(network, "publish", fail)
    with closing(cycles), pytest.raises(ValueError, match="/tf: no network"):
        for _ in cycles:
            pass


@pytest.mark.slow
def test_weak_publishers_and_garbage_are_heard_and_told(network, processes):
    live = processes.command("live", "--topic", "/weak/map", "--topic", "/bad/map")
    grid = explored(WORLD, 1.0, 9.0)
    bad = occupancy_grid(grid, 1.0, "bad/map")
    bad.info.resolution = math.nan
    told = (
        "/weak/map: heard as best effort, volatile",
        "weak: heard for the first time",
        "bad: resolution is nan, must be finite; the message is ignored",
    )

    def all_are_told() -> bool:
        network.publish("/weak/map", occupancy_grid(grid, 1.0, "weak/map"), Quality(reliable=False, latched=False))
        network.publish("/bad/map", bad, STREAM)
        return live.says(*told, seconds=0.5)

    assert wait_for(all_are_told), live.output
    assert live.end() == 1, live.output
    assert "0 of 2 robots joined" in live.output


def test_wrong_options_are_named(capsys, tmp_path):
    assert command("live") == 2
    assert "--topic, --discover or --from: one is needed" in capsys.readouterr().err
    assert command("live", "--topic", "/a/map", "--out", tmp_path / "bag") == 2
    assert "goes with --from" in capsys.readouterr().err


def test_a_configuration_of_dds_counts_more_than_the_variables_of_ros():
    assert "127.0.0.1" not in configuration({})
    assert "127.0.0.1" in configuration({"ROS_LOCALHOST_ONLY": "1"})
    assert "127.0.0.1" in configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"})
    assert "127.0.0.1" not in configuration({"ROS_LOCALHOST_ONLY": "0", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"})
    both = configuration({"CYCLONEDDS_URI": "file:///dds.xml", "ROS_LOCALHOST_ONLY": "1"})
    assert both.endswith(",file:///dds.xml")
    assert "127.0.0.1" not in both


@pytest.mark.parametrize("text", ["-1", "233", "abc"])
def test_a_wrong_domain_of_ros_is_named(text, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(ValueError, match=f"ROS_DOMAIN_ID is {text}, must be a number from 0 to 232"):
        ros_domain(None)
    assert ros_domain(7) == 7


def test_a_missing_package_is_named_with_its_remedy():
    with pytest.raises(ImportError, match=r"cyclonedds: pip install mapquilt\[live\]"), live_extra():
        raise ModuleNotFoundError(name="cyclonedds.sub")
