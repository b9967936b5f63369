"""`mapquilt convert`: round trips of each format, the source is never replaced, nothing is half-written."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapping.io.occupancy_grey import percent
from mapping.io.robot_log_file import load_robot_log, save_robot_log
from mapping.io.tum import load_tum
from mapquilt.runs.robot import load_run_robots
from tests.conftest import command, hashes

FRAME = GridFrame(0.0537123456789, SE2(-12.3456789, 7.1, 0.785398163397448), (9, 14))


def a_grid(seed: int = 2) -> OccupancyGrid:
    rng = np.random.default_rng(seed)
    log_odds = rng.normal(size=FRAME.shape).astype(np.float32) * 2.0
    log_odds[rng.random(FRAME.shape) < 0.3] = 0.0
    return OccupancyGrid(FRAME, log_odds)


@pytest.fixture
def source(tmp_path: Path) -> Path:
    save_map(a_grid(), tmp_path / "source")
    return tmp_path / "source.yaml"


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """The one line with which a call is refused."""
    status = command("convert", *arguments)
    captured = capsys.readouterr()
    assert (status, captured.out) == (2, "")
    (line,) = captured.err.splitlines()
    return line


# --- Maps ---


@pytest.mark.parametrize("ending", ["yaml", "pgm", "png"])
def test_a_map_becomes_the_same_map(source: Path, tmp_path: Path, ending: str) -> None:
    assert command("convert", source, tmp_path / f"a.b.{ending}") == 0
    again = load_map(tmp_path / "a.b.yaml").grid
    assert again.frame == FRAME  # every bit of resolution, origin and yaw
    np.testing.assert_array_equal(again.occupancy(), a_grid().occupancy())
    picture = "png" if ending == "png" else "pgm"
    assert set(hashes(tmp_path)) == {"source.yaml", "source.pgm", "a.b.yaml", f"a.b.{picture}"}


def test_from_pgm_to_png_and_back_is_the_same_file(source: Path, tmp_path: Path) -> None:
    (tmp_path / "back").mkdir()
    assert command("convert", source, tmp_path / "other.png") == 0
    assert command("convert", tmp_path / "other.yaml", tmp_path / "back/source.pgm") == 0
    for name in ("source.yaml", "source.pgm"):
        assert (tmp_path / "back" / name).read_bytes() == (tmp_path / name).read_bytes()


@pytest.mark.parametrize("mode", ["scale", "raw"])
def test_occupancy_survives_every_mode_that_can_hold_it(tmp_path: Path, mode: str) -> None:
    save_map(a_grid(), tmp_path / "source", mode="raw")
    assert command("convert", tmp_path / "source.yaml", tmp_path / "out.yaml", "--mode", mode) == 0
    loaded = load_map(tmp_path / "out.yaml").grid
    np.testing.assert_array_equal(percent(loaded), percent(a_grid()))
    assert len(np.unique(percent(loaded))) > 20
    assert loaded.frame == FRAME


def test_a_grey_that_means_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Image.fromarray(np.array([[205, 254, 0]], np.uint8)).save(tmp_path / "old.pgm")
    fields = "image: old.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    (tmp_path / "old.yaml").write_text(fields + "occupied_thresh: 0.65\nfree_thresh: 0.25\n")
    assert command("convert", tmp_path / "old.yaml", tmp_path / "older.yaml") == 0
    assert "old.yaml: grey 205" in capsys.readouterr().err
    assert command("convert", tmp_path / "old.yaml", tmp_path / "right.yaml", "--unknown", 205) == 0
    assert capsys.readouterr().err == ""
    assert command("convert", tmp_path / "old.yaml", tmp_path / "free.yaml", "--unknown", "none") == 0
    assert load_map(tmp_path / "older.yaml").grid.occupancy().tolist() == [[-1, 0, 100]]
    assert load_map(tmp_path / "free.yaml").grid.occupancy().tolist() == [[0, 0, 100]]
    assert load_map(tmp_path / "right.yaml").grid.occupancy().tolist() == [[-1, 0, 100]]


def test_merge_accepts_a_grey_that_means_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a", "b"):
        Image.fromarray(np.full((9, 9), 205, np.uint8)).save(tmp_path / f"{name}.pgm")
        fields = f"image: {name}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        (tmp_path / f"{name}.yaml").write_text(fields + "occupied_thresh: 0.65\nfree_thresh: 0.25\n")
    assert command("merge", tmp_path / "a.yaml", tmp_path / "b.yaml", "--unknown", 205) == 2
    assert "a.yaml: every cell of the map is unknown" in capsys.readouterr().err


def test_a_picture_without_yaml_gets_no_resolution(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source.unlink()
    picture = tmp_path / "source.pgm"
    assert "no resolution" in refused(capsys, picture, tmp_path / "out.yaml")
    assert "mode raw" in refused(capsys, picture, tmp_path / "out.png", "--mode", "raw")
    assert command("convert", picture, tmp_path / "out.png") == 0
    assert set(hashes(tmp_path)) == {"source.pgm", "out.png"}
    np.testing.assert_array_equal(load_map(tmp_path / "out.png").grid.occupancy(), a_grid().occupancy())


@pytest.mark.parametrize("out", ["source.yaml", "source.pgm", "source.png"])
def test_the_source_is_never_replaced(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], out: str):
    before = hashes(tmp_path)
    assert "would overwrite" in refused(capsys, source, tmp_path / out)
    assert hashes(tmp_path) == before


def test_the_source_is_recognised_under_another_name(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "link").symlink_to(tmp_path)
    assert "would overwrite" in refused(capsys, source, tmp_path / "link/source.pgm")


def test_a_link_is_followed_to_a_map_that_loads(source: Path, tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "out.yaml").symlink_to("disk/office.yaml")
    assert command("convert", source, tmp_path / "out.yaml") == 0
    assert (tmp_path / "out.yaml").is_symlink()
    assert set(hashes(tmp_path / "disk")) == {"office.yaml", "office.pgm"}
    assert load_map(tmp_path / "disk/office.yaml").grid.frame == FRAME


@pytest.mark.parametrize("out", ["out.pgm", "out.yaml"])
def test_a_device_is_never_replaced(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], out: str):
    os.mkfifo(tmp_path / "out.pgm")
    assert "out.pgm: exists and is not a regular file" in refused(capsys, source, tmp_path / out)
    assert (tmp_path / "out.pgm").is_fifo()
    assert not (tmp_path / "out.yaml").exists()


def test_an_older_file_is_replaced(source: Path, tmp_path: Path) -> None:
    save_map(a_grid(seed=9), tmp_path / "out")
    assert command("convert", source, tmp_path / "out.pgm") == 0
    np.testing.assert_array_equal(load_map(tmp_path / "out.yaml").grid.occupancy(), a_grid().occupancy())


# --- Trajectories and logs ---


def test_a_run_becomes_tum_trajectories(merged_run: Path, tmp_path: Path) -> None:
    assert command("convert", merged_run, tmp_path / "tum", "--to", "tum") == 0
    robots = load_run_robots(merged_run)
    files = {f"{robot.name}/{path}.tum" for robot in robots for path in ("odometry", "truth")}
    assert set(hashes(tmp_path / "tum")) == files
    for robot in robots:
        for name, path in (("odometry", robot.log.odometry), ("truth", robot.world_from_base)):
            read = load_tum(tmp_path / "tum" / robot.name / f"{name}.tum")
            np.testing.assert_array_equal(read.stamps, path.stamps)
            np.testing.assert_array_equal(read.poses[:, :2], path.poses[:, :2])
            np.testing.assert_allclose(np.sin(read.poses[:, 2] - path.poses[:, 2]), 0.0, atol=1e-14)


@pytest.fixture(scope="module")
def run_in_parts(merged_run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs") / "parts"
    assert command("sense", merged_run, "--parts", 3, "--out", out) == 0
    return out


def test_a_run_cut_in_parts_becomes_the_parts_of_each_robot(
    merged_run: Path, run_in_parts: Path, tmp_path: Path
) -> None:
    for run, name in ((merged_run, "whole"), (run_in_parts, "parts")):
        assert command("convert", run, tmp_path / name, "--to", "tum") == 0
    for robot in ("robot_0", "robot_1"):
        whole = load_tum(tmp_path / "whole" / robot / "truth.tum")
        for file in ("truth.tum", "odometry.tum"):
            cut = [load_tum(tmp_path / "parts" / f"{robot}_part_{part}" / file) for part in range(3)]
            np.testing.assert_array_equal(np.concatenate([part.stamps for part in cut]), whole.stamps)
            if file == "truth.tum":
                np.testing.assert_array_equal(np.concatenate([part.poses for part in cut]), whole.poses)


@pytest.mark.parametrize("to", ["carmen", "rosbag"])
def test_a_run_cut_in_parts_has_every_format(run_in_parts: Path, tmp_path: Path, to: str) -> None:
    assert command("convert", run_in_parts, tmp_path / "out", "--to", to) == 0
    if to == "carmen":
        assert len(list((tmp_path / "out").glob("robot_?_part_?/log.carmen"))) == 6


def test_a_run_whose_maps_are_not_those_of_its_mission_is_refused(run_in_parts: Path, tmp_path: Path, capsys) -> None:
    run = Path(shutil.copytree(run_in_parts, tmp_path / "run"))
    (run / "run.json").write_text((run / "run.json").read_text().replace('"parts": 3', '"parts": 2'))
    line = refused(capsys, run, tmp_path / "out", "--to", "tum")
    assert "mission: holds robot_0_part_0, robot_0_part_1, robot_1_part_0, robot_1_part_1, but" in line
    assert not (tmp_path / "out").exists()


def test_a_run_becomes_carmen_logs_with_the_true_poses(merged_run: Path, tmp_path: Path) -> None:
    assert command("convert", merged_run, tmp_path / "carmen", "--to", "carmen") == 0
    for robot in load_run_robots(merged_run):
        lines = (tmp_path / "carmen" / robot.name / "log.carmen").read_text().splitlines()
        words = [line.split() for line in lines if not line.startswith("#")]
        assert [entry[0] for entry in words] == ["TRUEPOS", "ROBOTLASER1"] * len(robot.log.scans)
        poses = np.array([[float(word) for word in entry[1:7]] for entry in words[::2]])
        np.testing.assert_array_equal(poses[:, :2], robot.world_from_base.poses[:, :2])
        np.testing.assert_array_equal(poses[:, 3:5], robot.log.odometry.poses[:, :2])
        beams = robot.log.scans[0].ranges.size
        for entry, scan in zip(words[1::2], robot.log.scans, strict=True):
            assert int(entry[8]) == beams
            readings = np.array(entry[9 : 9 + beams], dtype=np.float32)
            np.testing.assert_array_equal(readings[scan.returned], scan.ranges[scan.returned])


def test_a_single_log_becomes_its_odometry_or_its_scans(merged_run: Path, tmp_path: Path) -> None:
    log = merged_run / "robot_1/log.npz"
    assert command("convert", log, tmp_path / "path.tum") == 0
    assert command("convert", log, tmp_path / "path.txt", "--to", "tum") == 0
    assert (tmp_path / "path.tum").read_bytes() == (tmp_path / "path.txt").read_bytes()
    odometry = load_robot_log(log).odometry
    np.testing.assert_array_equal(load_tum(tmp_path / "path.tum").poses[:, :2], odometry.poses[:, :2])
    assert command("convert", log, tmp_path / "robot.carmen") == 0
    text = (tmp_path / "robot.carmen").read_text()
    assert text.count("\nROBOTLASER1 ") == len(odometry)
    assert "\nTRUEPOS " not in text  # a log holds no truth


# --- Refusals ---


def test_the_folder_is_made_and_every_file_named(source: Path, merged_run: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "new/folder"
    assert command("convert", source, out / "m.pgm") == 0
    yaml, picture = out / "m.yaml", out / "m.pgm"
    assert yaml.is_file() and picture.is_file()
    assert capsys.readouterr().out == f"written: {yaml} and {picture}, 14 x 9 cells of 0.0537123 m\n"
    assert command("convert", picture.rename(tmp_path / "bare.pgm"), out / "other/bare.png") == 0
    assert capsys.readouterr().out == f"written: {out / 'other/bare.png'}, 14 x 9 cells\n"
    assert command("convert", merged_run / "robot_0/log.npz", out / "logs/a.tum") == 0
    assert capsys.readouterr().out.startswith(f"written: {out / 'logs/a.tum'}, odometry of ")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("none.yaml", "out.pgm"), "none.yaml: no such file or folder"),
        (("source.yaml", "out"), "out: the extension names no format; add --to with one of map, tum, carmen, rosbag"),
        (("bag", "out.yaml"), "bag: is a ROS bag; `mapquilt map bag --out DIR` writes its map and trajectory.tum"),
        (("robot.clf", "out.tum"), "robot.clf: is a CARMEN log; `mapquilt map robot.clf --out DIR` writes"),
        (("source.yaml", "out.tum"), "source.yaml: a map cannot be converted to tum"),
        (("source.yaml", "out", "--to", "rosbag"), "source.yaml: a map cannot be converted to rosbag"),
        (("source.yaml", "out.jpg", "--to", "map"), "out.jpg: a map must end in .yaml, .pgm or .png"),
        (("source.yaml", "out.yml"), "out.yml: a map must end in .yaml, .pgm or .png"),
        (("source.yaml", "out.pgm", "--mode", "scale"), "out.pgm: a PGM cannot mark"),
        (("source.yaml", "out.pgm", "--mode", "grey"), "--mode"),
        (("source.yaml", "out.pgm", "--unknown", "256"), "--unknown"),
        (("source.yaml", "out.pgm", "--to", "pdf"), "--to"),
        (("run", "", "--to", "tum"), "the name is empty"),
        (("run", "out.yaml"), "run: a run has several maps; give one of them"),
        (("run", "out.tum"), "out.tum: a run is written as a folder; choose a name without .tum"),
        (("run", "out.mcap"), "out.mcap: a run is written as a folder; choose a name without .mcap"),
        (("run", "run", "--to", "tum"), "run: is not empty; choose a new folder"),
        (("run", "source.pgm", "--to", "map"), "run: a run has several maps"),
        (("run", "file", "--to", "tum"), "file: exists and is not a folder"),
        (("run", "out", "--to", "tum", "--mode", "raw"), "--crop are for maps, not for tum"),
        (("run/mission", "out", "--to", "tum"), "run/mission: is not a run"),
        (("run/robot_0/log.npz", "out", "--to", "rosbag"), "log.npz: a robot's log can be converted to tum or carmen"),
        (("run/robot_0/log.npz", "out.pgm"), "log.npz: a robot's log can be converted to tum or carmen, not map"),
    ],
)
def test_an_impossible_conversion_ends_in_one_line_and_writes_nothing(
    source: Path, merged_run: Path, tmp_path: Path, capsys, monkeypatch, arguments: tuple[str, ...], expected: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").symlink_to(merged_run)
    (tmp_path / "file").touch()
    (tmp_path / "robot.clf").touch()
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag/metadata.yaml").touch()
    before = sorted(tmp_path.rglob("*")), hashes(merged_run)
    assert expected in refused(capsys, *arguments)
    assert (sorted(tmp_path.rglob("*")), hashes(merged_run)) == before


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


@pytest.mark.parametrize("file", ["robot_1/log.npz", "robot_1/map.pgm", "mission/robot_1.npz", "maps.json"])
@pytest.mark.parametrize("to", ["tum", "carmen", "rosbag"])
def test_a_damaged_run_is_refused_by_the_files_name(fresh_run: Path, capsys, file: str, to: str) -> None:
    cut(fresh_run / file)
    out = fresh_run.parent / "out"
    assert f"{fresh_run / file}: " in refused(capsys, fresh_run, out, "--to", to)
    assert list(fresh_run.parent.iterdir()) == [fresh_run]


@pytest.mark.parametrize("file", ["robot_1/log.npz", "mission/robot_0.npz", "mission/world.json", "robot_0/map.yaml"])
def test_a_missing_file_of_a_run_is_named(fresh_run: Path, capsys, file: str) -> None:
    (fresh_run / file).unlink()
    assert f"{fresh_run / file}: " in refused(capsys, fresh_run, fresh_run.parent / "out", "--to", "rosbag")
    assert list(fresh_run.parent.iterdir()) == [fresh_run]


@pytest.mark.parametrize("to", ["tum", "carmen", "rosbag"])
def test_a_log_of_another_mission_is_refused(fresh_run: Path, capsys, to: str) -> None:
    log = load_robot_log(fresh_run / "robot_1/log.npz")
    save_robot_log(fresh_run / "robot_1/log.npz", log.part(1, len(log.scans)))
    assert "robot_1: log and truth have different stamps" in refused(
        capsys, fresh_run, fresh_run.parent / "out", "--to", to
    )
    assert list(fresh_run.parent.iterdir()) == [fresh_run]


@pytest.mark.parametrize("name", ["../../evil", "/tmp/evil", "..", "robot-0", "0"])
def test_a_robots_name_cannot_lead_out_of_the_folder(fresh_run: Path, capsys, name: str) -> None:
    maps = fresh_run / "maps.json"
    maps.write_text(maps.read_text().replace('"name": "robot_0"', f'"name": "{name}"'))
    assert f"{maps}: name is '{name}'" in refused(capsys, fresh_run, fresh_run.parent / "out", "--to", "tum")
    assert list(fresh_run.parent.iterdir()) == [fresh_run]


def test_without_rosbags_the_message_says_how_to_install_it(
    merged_run: Path, tmp_path: Path, capsys, monkeypatch
) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, name)
    for name in ("mapquilt.convert.ros_bag", "mapquilt.convert.ros_messages"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    assert "pip install mapquilt[ros]" in refused(capsys, merged_run, tmp_path / "bag", "--to", "rosbag")
    assert list(tmp_path.iterdir()) == []
    assert command("convert", merged_run, tmp_path / "tum", "--to", "tum") == 0  # the others need it not


def test_an_empty_folder_is_accepted(merged_run: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert command("convert", merged_run, tmp_path / "out", "--to", "tum") == 0
    assert len(hashes(tmp_path / "out")) == 4
