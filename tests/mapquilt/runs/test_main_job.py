"""A complete run, stage by stage: its files, and what each of them depends on."""

import json
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest

from mapping.io.map_file import load_map
from mapping.io.robot_log_file import load_robot_log
from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import load_truth
from sim.mission.file import load_mission
from tests.conftest import command, hashes

FILES = {
    "run.json",
    "maps.json",
    "coverage.json",
    "coverage.png",
    "truth.json",
    ".mapquilt-files.json",
    "merge.json",
    "score.json",
    "timings.json",
    "merged.pgm",
    "merged.yaml",
    "conflicts.pgm",
    "conflicts.yaml",
    "transforms.yaml",
    "merge.png",
    "refused.png",
    "overview.png",
    "mission/world.json",
    "mission/mission.json",
    *(f"truth/{name}.{suffix}" for name in ("world", "robot_0", "robot_1") for suffix in ("png", "yaml")),
    *(f"mission/robot_{k}.npz" for k in range(2)),
    *(f"robot_{k}/{name}" for k in range(2) for name in ("map.pgm", "map.yaml", "log.npz")),
}

simulate = ("simulate", "office", "--robots", 2, "--duration", 12, "--seed", 3)


def test_a_run_has_all_its_files(merged_run):
    assert set(hashes(merged_run, but=())) == FILES
    for name in ("overview.png", "merge.png", "refused.png"):
        assert cv2.imread(str(merged_run / name)).shape[0] > 300


def test_the_same_seed_gives_the_same_bytes_in_another_process(merged_run, tmp_path):
    again = tmp_path / "again"
    for arguments in ((*simulate, "--out", again), ("merge", again), ("score", again)):
        done = subprocess.run([sys.executable, "-m", "mapquilt", *map(str, arguments)], check=False)
        assert done.returncode in (0, 1)
    assert hashes(again) == hashes(merged_run)


def test_another_seed_gives_another_world_and_start(merged_run, tmp_path):
    other = tmp_path / "other"
    assert command("simulate", "office", "--robots", 2, "--duration", 2, "--seed", 4, "--out", other) == 0
    assert (other / "mission/world.json").read_bytes() != (merged_run / "mission/world.json").read_bytes()
    a, b = (load_truth(run / "truth.json").robots[0] for run in (other, merged_run))
    assert a.world_from_start != b.world_from_start
    assert a.start_from_map != b.start_from_map


def test_another_noise_level_keeps_the_hashes_of_the_mission(merged_run, tmp_path):
    noisy, exact = tmp_path / "noisy", tmp_path / "exact"
    assert command(*simulate, "--noise", 3, "--out", noisy) == 0
    assert command("sense", merged_run, "--noise", 0, "--out", exact) == 0
    mission = hashes(merged_run / "mission")
    assert hashes(noisy / "mission") == hashes(exact / "mission") == mission
    assert (noisy / "robot_0/map.pgm").read_bytes() != (merged_run / "robot_0/map.pgm").read_bytes()


def test_sense_and_simulate_agree(merged_run, tmp_path):
    again = tmp_path / "again"
    assert command("sense", merged_run, "--out", again) == 0
    left = hashes(again)
    del left[".mapquilt-files.json"]
    assert left.items() <= hashes(merged_run).items()
    assert "truth.json" in left


def test_without_noise_the_log_is_the_truth(merged_run, tmp_path):
    exact = tmp_path / "exact"
    assert command("sense", merged_run, "--noise", 0, "--scale", "honest", "--poses", "odometry", "--out", exact) == 0
    mission, log = load_mission(exact / "mission"), load_robot_log(exact / "robot_1/log.npz")
    truth = mission.robots[1]
    assert all(np.array_equal(a.ranges, b.ranges) for a, b in zip(log.scans, truth.scans, strict=True))
    assert log.odometry.poses == pytest.approx(truth.trajectory.from_start().poses, abs=1e-9)
    assert all(robot.truth.distortion < 1e-4 for robot in load_truth(exact / "truth.json").robots)


@pytest.mark.parametrize("scale", ["hidden", "honest"])
def test_the_merger_never_reads_the_truth(merged_run, tmp_path, scale):
    fresh_run = tmp_path / "run"
    assert command("sense", merged_run, "--scale", scale, "--out", fresh_run) == 0
    assert command("merge", fresh_run) in (0, 1)
    before = (fresh_run / "merge.json").read_bytes()
    (fresh_run / "truth.json").unlink()
    shutil.rmtree(fresh_run / "mission")
    shutil.rmtree(fresh_run / "truth")
    assert command("merge", fresh_run) in (0, 1)
    assert (fresh_run / "merge.json").read_bytes() == before


def test_the_stored_truth_scores_zero_and_its_inverse_does_not(fresh_run):
    stored = json.loads((fresh_run / "truth.json").read_text())
    stored["pairs"][0]["overlap"] = 0.5  # without common ground there is no error
    (fresh_run / "truth.json").write_text(json.dumps(stored))
    truth = load_truth(fresh_run / "truth.json").pairs["robot_0", "robot_1"].target_from_source
    record = json.loads((fresh_run / "merge.json").read_text())
    errors = []
    for answer in (truth, truth.inverse()):
        record["pairs"][0]["target_from_source"] = {
            "x": answer.x, "y": answer.y, "yaw": answer.yaw, "scale": answer.scale
        }  # fmt: skip
        (fresh_run / "merge.json").write_text(json.dumps(record))
        assert command("score", fresh_run) == 0
        errors.append(json.loads((fresh_run / "score.json").read_text())["pairs"][0])
    assert errors[0]["rotation_deg"] == 0.0
    assert errors[0]["displacement_m"] in (0.0, None)
    assert errors[1]["rotation_deg"] > 0.1


def test_maps_of_hidden_scale_are_marked_as_not_trusted(merged_run, tmp_path):
    honest = tmp_path / "honest"
    assert command("sense", merged_run, "--scale", "honest", "--out", honest) == 0
    assert run_folder.load_maps(honest).resolutions_trusted
    assert not run_folder.load_maps(merged_run).resolutions_trusted
    assert all(robot.start_from_map.scale == 1.0 for robot in load_truth(honest / "truth.json").robots)
    scales = [robot.start_from_map.scale for robot in load_truth(merged_run / "truth.json").robots]
    assert all(0.5 <= scale <= 2.0 and abs(scale - 1.0) > 1e-3 for scale in scales)


def test_frame_perturbations_are_drawn_from_the_requested_ranges(merged_run, tmp_path):
    arguments = ("--scale", "0.9:1.1", "--max-rotation", 5, "--max-offset", 0.5)
    assert command("sense", merged_run, *arguments, "--out", tmp_path / "near") == 0
    for robot in load_truth(tmp_path / "near/truth.json").robots:
        map_from_start = robot.start_from_map.inverse()
        assert 0.9 <= robot.start_from_map.scale <= 1.1
        assert abs(map_from_start.yaw) <= np.radians(5)
        assert max(abs(map_from_start.x), abs(map_from_start.y)) <= 0.5


def test_a_mission_cut_in_parts_gives_a_map_per_part(merged_run, tmp_path):
    assert command("sense", merged_run, "--parts", 2, "--noise", 0, "--out", tmp_path / "parts") == 0
    maps, truth = run_folder.load_maps(tmp_path / "parts"), load_truth(tmp_path / "parts/truth.json")
    assert maps.names == ("robot_0_part_0", "robot_0_part_1", "robot_1_part_0", "robot_1_part_1")
    assert len(truth.pairs) == 6
    first, second = (load_robot_log(tmp_path / f"parts/robot_0_part_{k}/log.npz") for k in (0, 1))
    whole = load_mission(merged_run / "mission").robots[0]
    stamps = [scan.stamp for log in (first, second) for scan in log.scans]
    assert stamps == [scan.stamp for scan in whole.scans]
    start = whole.trajectory.pose(len(first.scans))
    assert truth.robot("robot_0_part_1").world_from_start == start
    assert command("merge", tmp_path / "parts") in (0, 1)
    assert command("score", tmp_path / "parts") == 0


def test_maps_are_those_of_map_server(merged_run):
    loaded = load_map(merged_run / "robot_0/map.yaml")
    assert loaded.grid.frame.resolution == 0.05
    assert loaded.grid.frame.origin.yaw == 0.0
    assert loaded.grid.occupied.sum() > 100


def test_merging_again_deletes_the_old_score(fresh_run):
    assert command("merge", fresh_run) in (0, 1)
    assert not (fresh_run / "score.json").exists()
    assert not (fresh_run / "overview.png").exists()


def test_sense_and_merge_work_without_pybullet(merged_run, tmp_path):
    blocked = (
        "import sys; sys.modules['pybullet'] = None; from mapquilt.cli.app import run; sys.exit(run(sys.argv[1:]))"
    )
    for arguments in (("sense", merged_run, "--out", tmp_path / "run"), ("merge", tmp_path / "run")):
        done = subprocess.run([sys.executable, "-c", blocked, *map(str, arguments)], check=False, capture_output=True)
        assert done.returncode in (0, 1), done.stderr.decode()
    done = subprocess.run(
        [sys.executable, "-c", blocked, *map(str, simulate), "--out", str(tmp_path / "new")],
        check=False,
        capture_output=True,
    )
    assert done.returncode == 2
    assert b"pybullet" in done.stderr
    assert len(done.stderr.splitlines()) == 1
