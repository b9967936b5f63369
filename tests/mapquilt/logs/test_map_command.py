"""``mapquilt map``: known walls, files that are read back, the truth of parts, and refusals."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapping.io.carmen import save_carmen
from mapping.io.map_file import load_map
from mapping.io.robot_log_file import save_robot_log
from mapping.io.tum import load_tum, save_tum
from mapquilt.json_file import read_record
from mapquilt.runs.truth_file import load_truth
from tests.conftest import command, hashes
from tests.mapquilt.logs.bags import Messages
from tests.mapquilt.logs.rooms import HALF_HEIGHT, HALF_WIDTH, POST, room_log


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "room.log"
    recorded = room_log(drift=0.1)
    save_carmen(path, recorded.log, recorded.reference)
    return path


def distance_to_walls(points: np.ndarray) -> np.ndarray:
    """Distances of points (N, 2) to the walls of the room and to the sides of the post."""
    x, y = np.abs(points).T
    room = np.minimum(np.abs(x - HALF_WIDTH), np.abs(y - HALF_HEIGHT))
    centre, half = np.array(POST[:2]) + POST[2] / 2.0, POST[2] / 2.0
    dx, dy = (np.abs(points - centre) - half).T
    post = np.where((dx > 0) | (dy > 0), np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)), -np.maximum(dx, dy))
    return np.minimum(room, post)


def test_walls_of_a_map_at_the_reference_lie_where_they_are(tmp_path: Path, log: Path) -> None:
    assert command("map", log, "--poses", "reference", "--out", tmp_path / "map") == 0
    grid = load_map(tmp_path / "map" / "map.yaml").grid
    reference = room_log().reference
    assert reference is not None
    walls = reference.pose(0).apply(grid.frame.metres_from_cells(np.argwhere(grid.occupied)))
    assert len(walls) > 400
    assert distance_to_walls(walls).max() < 0.05
    assert not (tmp_path / "map" / "graph.g2o").exists()


def test_files_of_a_map_agree_with_the_log(tmp_path: Path, log: Path) -> None:
    assert command("map", log, "--poses", "odometry", "--out", tmp_path / "map") == 0
    recorded = room_log(drift=0.1)
    path = load_tum(tmp_path / "map" / "trajectory.tum")
    expected = recorded.log.odometry.from_start()
    np.testing.assert_array_equal(path.stamps, expected.stamps)
    np.testing.assert_allclose(path.poses[:, :2], expected.poses[:, :2], atol=1e-12)
    record = read_record(tmp_path / "map" / "map.json", "map")
    assert record["path_m"] == pytest.approx(expected.distance())
    assert (record["scans"], record["beams"], record["poses"], record["log"]) == (60, 120, "odometry", "room.log")
    assert record["duration_s"] == pytest.approx(59 * 0.2)
    fit = record["reference"]
    assert recorded.reference is not None
    assert 0.05 < fit["position_rmse_m"] < fit["position_max_m"] < 2.0


def test_the_same_log_gives_the_same_bytes(tmp_path: Path, log: Path) -> None:
    for name in ("one", "two"):
        assert command("map", log, "--poses", "odometry", "--out", tmp_path / name) == 0
    assert hashes(tmp_path / "one") == hashes(tmp_path / "two")


def test_part_of_a_log_is_mapped(tmp_path: Path, log: Path) -> None:
    options = ("--poses", "odometry", "--start", 2, "--end", 4.05, "--max-rate", 2.5, "--resolution", 0.1)
    assert command("map", log, *options, "--out", tmp_path / "map") == 0
    record = read_record(tmp_path / "map" / "map.json", "map")
    np.testing.assert_allclose((record["start_s"], record["duration_s"], record["scans"]), (102.0, 2.0, 6), atol=1e-9)
    assert load_map(tmp_path / "map" / "map.yaml").grid.frame.resolution == 0.1


def test_parts_are_a_run_with_the_truth_of_each_pair(tmp_path: Path, log: Path) -> None:
    out = tmp_path / "run"
    assert command("map", log, "--poses", "reference", "--parts", 3, "--out", out) == 0
    reference = room_log().reference
    assert reference is not None
    starts = [Similarity2.from_se2(reference.pose(k)) for k in (0, 20, 40)]
    truth = load_truth(out / "truth.json")
    assert [robot.name for robot in truth.robots] == ["part_0", "part_1", "part_2"]
    for robot, start in zip(truth.robots, starts, strict=True):
        np.testing.assert_allclose((start.inverse() @ robot.truth.world_from_map).log(), 0.0, atol=1e-9)
    for (target, source), pair in truth.pairs.items():
        expected = starts[int(target[-1])].inverse() @ starts[int(source[-1])]
        np.testing.assert_allclose((expected.inverse() @ pair.target_from_source).log(), 0.0, atol=0.003)
        assert pair.fitted
        assert pair.residual < 0.02  # endpoints are averaged over cells of 0.05 m
        assert pair.footprints.overlap > 0.9


def test_parts_that_drift_leave_a_residual(tmp_path: Path, log: Path) -> None:
    assert command("map", log, "--poses", "odometry", "--parts", 2, "--out", tmp_path / "run") == 0
    (pair,) = load_truth(tmp_path / "run" / "truth.json").pairs.values()
    assert pair.residual is not None
    assert pair.residual > 0.05


@pytest.mark.slow
def test_a_run_of_parts_is_merged_and_scored(tmp_path: Path, log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    assert command("map", log, "--poses", "reference", "--parts", 2, "--out", out) == 0
    assert command("merge", out) in (0, 1)
    assert command("score", out) == 0
    score = json.loads((out / "score.json").read_text())
    assert score["pairs"][0]["true_overlap"] > 0.9
    assert (out / "overview.png").stat().st_size > 10_000
    assert "part_0 <- part_1" in capsys.readouterr().out
    assert command("map", out, "--poses", "reference", "--out", tmp_path / "again") == 0
    for name in ("map.pgm", "map.yaml", "log.npz"):
        assert (tmp_path / "again" / "part_1" / name).read_bytes() == (out / "part_1" / name).read_bytes()


def test_several_logs_make_a_run_without_truth(tmp_path: Path, log: Path) -> None:
    save_robot_log(tmp_path / "room.npz", room_log().log)
    out = tmp_path / "run"
    assert command("map", log, tmp_path / "room.npz", "--poses", "odometry", "--out", out) == 0
    names = [entry["name"] for entry in read_record(out / "maps.json", "maps")["maps"]]
    assert names == ["room", "room_1"]
    assert not (out / "truth.json").exists()


def test_poses_of_trajectory_files_replace_those_of_the_log(tmp_path: Path) -> None:
    recorded = room_log()
    assert recorded.reference is not None
    save_robot_log(tmp_path / "log.npz", recorded.log)
    save_tum(tmp_path / "true.tum", recorded.reference)
    files = ("--odometry", tmp_path / "true.tum", "--reference", tmp_path / "true.tum")
    assert command("map", tmp_path / "log.npz", "--poses", "odometry", *files, "--out", tmp_path / "map") == 0
    fit = read_record(tmp_path / "map" / "map.json", "map")["reference"]
    assert fit["position_max_m"] < 1e-9
    pose = recorded.reference.pose(0)
    np.testing.assert_allclose(list(fit["reference_from_map"].values()), (pose.x, pose.y, pose.yaw), atol=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--poses", "truth"), "--poses truth: must be one of"),
        (("--parts", 0), "--parts 0: must lie between 1 and"),
        (("--parts", 20, "--end", 1), "has 6 scans, fewer than 20 parts"),
        (("--start", 100), "no scan from 100 s to the end: the log lasts 11.8 s"),
        (("--start", -1), "--start -1: must be at least 0 s"),
        (("--start", 5, "--end", 4), "--end 4: must be after the start, 5 s"),
        (("--max-rate", 0), "--max-rate 0: must be positive"),
        (("--resolution", 0), "--resolution 0.0: must lie between"),
        (("--scan-topic", "/scan"), "--scan-topic /scan: "),
        (("--set", "merge.scale=free"), "--set merge.scale=free: must name a setting of mapping"),
        (("--set", "mapping.nothing=1"), "--set mapping.nothing=1: mapping.nothing is no setting"),
    ],
)
def test_options_that_cannot_be_are_refused(tmp_path: Path, log: Path, capsys, options, message: str) -> None:  # type: ignore[no-untyped-def]
    assert command("map", log, "--out", tmp_path / "map", "--poses", "odometry", *options) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "map").exists()


def test_poses_that_a_log_does_not_have_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = Messages("mcap")
    for k in range(3):
        bag.scan("/scan", 1.0 + k, (1.0, 2.0))
    path = bag.write(tmp_path)
    for poses, message in (("odometry", "has no odometry"), ("reference", "has no reference poses")):
        assert command("map", path, "--poses", poses, "--out", tmp_path / "map") == 2
        assert f"{path}: {message}" in capsys.readouterr().err
    assert command("map", path, "--mapper", "particle", "--out", tmp_path / "map") == 2
    assert f"{path}: has no odometry, which --mapper particle needs" in capsys.readouterr().err


def test_what_is_no_log_or_no_folder_of_maps_is_left_alone(tmp_path: Path, log: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "diary.txt").write_text("dear diary")
    for source, message in (
        (log, "mine: is not empty and holds no map.json of mapquilt; refusing to replace it"),
        (tmp_path / "mine", "mine: is neither a run nor a ROS 2 bag"),
        (tmp_path / "mine" / "diary.txt", "diary.txt: must be a run, or end in .bag"),
        (tmp_path / "none.bag", "none.bag: no such file"),
    ):
        out = tmp_path / ("mine" if source == log else "map")
        assert command("map", source, "--poses", "odometry", "--out", out) == 2
        assert message in capsys.readouterr().err
    assert (tmp_path / "mine" / "diary.txt").read_text() == "dear diary"


def test_without_rosbags_the_message_says_how_to_install_it(tmp_path: Path, capsys, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0")
    for name in [name for name in sys.modules if name.split(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "mapquilt.logs.bag_log", raising=False)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    assert command("map", tmp_path / "a.bag", "--out", tmp_path / "map") == 2
    assert "a ROS bag needs the package rosbags: pip install mapquilt[ros]" in capsys.readouterr().err
