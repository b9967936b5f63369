"""Record, picture and files of a map with a pose graph, by a stand-in for SLAM with odometry edges and one loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.robot.recorded_log import RecordedLog
from mapping.settings import MappingSettings
from mapping.slam.result import Edge, LoopEvidence, SlamResult
from mapquilt.json_file import check_record, read_record
from mapquilt.logs.load_log import NamedLog
from mapquilt.logs.log_map import LogMap, draw_log
from mapquilt.logs.map_folder import write_log_map
from mapquilt.logs.map_record import map_record
from mapquilt.viz.log_map_picture import log_map_figure
from tests.mapquilt.logs.rooms import room_log

EVIDENCE = LoopEvidence(0.6, 0.9, 0.5)


def stand_in(recorded: RecordedLog) -> SlamResult:
    """Take odometry for the trajectory, every tenth scan as a keyframe, and close the circle."""
    trajectory = recorded.log.odometry.from_start()
    keyframes = np.arange(0, len(trajectory), 10)
    covariance = np.diag([1e-4, 4e-4, 1e-6])
    poses = [trajectory.pose(k) for k in keyframes.tolist()]
    edges = [Edge(k, k + 1, poses[k].inverse() @ poses[k + 1], covariance) for k in range(len(poses) - 1)]
    edges.append(Edge(0, len(poses) - 1, poses[0].inverse() @ poses[-1], covariance, EVIDENCE))
    return SlamResult(trajectory, keyframes, tuple(edges), {"tracking": 1.25, "loops": 0.5})


@pytest.fixture(scope="module")
def drawn() -> LogMap:
    recorded = room_log(drift=0.05)
    by_odometry = draw_log(NamedLog("room", recorded, Path("room.bag")), MappingSettings("odometry"))
    result = stand_in(recorded)
    return LogMap("room", by_odometry.path, recorded, by_odometry.settings, result, by_odometry.grid)


def test_the_record_has_the_loops_with_their_evidence(drawn: LogMap) -> None:
    record = map_record(drawn)
    check_record(Path("map.json"), "map", record)
    assert record["keyframes"] == [0, 10, 20, 30, 40, 50]
    assert record["edges"] == 6
    (loop,) = record["loops"]
    assert (loop["first"], loop["second"], loop["agreement"], loop["runner_up"]) == (0, 5, 0.9, 0.5)
    np.testing.assert_allclose(loop["deviation"], (0.01, 0.02, 0.001))
    found = SE2(**loop["first_from_second"])
    expected = drawn.result.trajectory.pose(50)
    np.testing.assert_allclose((found.x, found.y, found.yaw), (expected.x, expected.y, expected.yaw))


def test_settings_that_differ_from_their_defaults_are_recorded(drawn: LogMap) -> None:
    settings = MappingSettings("odometry", 0.1, "karto")
    changed = LogMap("room", drawn.path, drawn.recorded, settings, drawn.result, drawn.grid)
    assert map_record(changed)["settings"] == {"resolution": 0.1, "sensor_model": "karto"}
    assert map_record(drawn)["settings"] == {}


def test_the_folder_has_the_graph(drawn: LogMap, tmp_path: Path) -> None:
    write_log_map(tmp_path / "map", drawn)
    names = [line.split()[0] for line in (tmp_path / "map" / "graph.g2o").read_text().splitlines()]
    assert names == ["VERTEX_SE2"] * 6 + ["FIX"] + ["EDGE_SE2"] * 6
    timings = read_record(tmp_path / "map" / "timings.json", "timings")
    assert timings == {"unit": "s", "map": {"tracking": 1.25, "loops": 0.5}}


def test_the_picture_has_path_keyframes_and_loops_where_they_are(drawn: LogMap) -> None:
    path = drawn.result.trajectory.poses[:, :2]
    figure = log_map_figure("room", "", drawn.grid, path, drawn.result.keyframes, [(0, 50)], path + 1.0)
    (panel,) = figure.axes
    lines = {line.get_label(): np.asarray(line.get_xydata()) for line in panel.lines}
    np.testing.assert_array_equal(lines["path"], path)
    np.testing.assert_array_equal(lines["reference"], path + 1.0)
    np.testing.assert_array_equal(lines["6 keyframes"], path[::10])
    (loops,) = panel.collections
    np.testing.assert_array_equal(loops.get_segments(), [path[[0, 50]]])
    left, right = panel.get_xlim()
    low, high = panel.get_ylim()
    width, height = panel.get_window_extent().size
    assert (right - left) / width == pytest.approx((high - low) / height, rel=1e-6)
