"""``mapquilt slam-eval``: known errors from files of each kind, the record, and refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from mapping.io.carmen import save_carmen
from mapping.io.tum import save_tum
from mapping.robot.trajectory import Trajectory
from mapquilt.json_file import read_record
from tests.conftest import command
from tests.mapquilt.logs.rooms import room_log

LINE = Trajectory(np.arange(21.0), [(0.5 * k, 0.0, 0.0) for k in range(21)])


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A straight line, and an estimate of it that zigzags by 0.1 m; moved and turned, which alignment takes back."""
    save_tum(tmp_path / "line.tum", LINE)
    # Pairs of equal sign balance position and moment about the middle, so that the best fit is the line itself.
    offsets = 0.1 * np.array([1, -1, -1, 1] * 2 + [0] + [0] * 3 + [0] + [1, -1, -1, 1] * 2)
    poses = LINE.poses.copy()
    poses[:, 1] += offsets
    save_tum(tmp_path / "zigzag.tum", Trajectory(LINE.stamps + 0.005, poses + np.array((3.0, -7.0, 0.0))))
    return tmp_path / "zigzag.tum", tmp_path / "line.tum"


def test_a_known_zigzag(files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert command("slam-eval", files[0], "--reference", files[1], "--metres", 1, "--seconds", 4, "--out", out) == 0
    record = read_record(out / "slam_eval.json", "slam_eval")
    position = record["absolute"]["position_m"]
    assert record["poses"] == 21
    assert position["rmse"] == pytest.approx(0.1 * math.sqrt(16 / 21), abs=1e-9)
    assert position["max"] == pytest.approx(0.1, abs=1e-9)
    assert position["median"] == pytest.approx(0.1, abs=1e-9)
    metre, four = record["relative"]
    assert (metre["length"], metre["unit"], metre["error"]["pairs"]) == (1.0, "m", 19)
    assert metre["error"]["translation_m"]["max"] == pytest.approx(0.2, abs=1e-9)
    assert (four["unit"], four["error"]["pairs"]) == ("s", 17)
    assert (out / "slam_eval.png").read_bytes().startswith(b"\x89PNG")
    table = capsys.readouterr().out
    assert "0.087" in table
    assert max(map(len, table.splitlines())) <= 80


def test_a_log_is_measured_against_its_own_reference(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded = room_log(drift=0.1)
    log = tmp_path / "room.log"
    save_carmen(log, recorded.log, recorded.reference)
    assert command("map", log, "--poses", "odometry", "--out", tmp_path / "map") == 0
    found = []
    for estimate in (log, tmp_path / "map"):
        capsys.readouterr()
        assert command("slam-eval", estimate, "--reference", log, "--json") == 0
        found.append(json.loads(capsys.readouterr().out)["absolute"]["position_m"]["rmse"])
    fit = read_record(tmp_path / "map" / "map.json", "map")["reference"]
    np.testing.assert_allclose(found, fit["position_rmse_m"], rtol=1e-9)
    assert command("slam-eval", log, "--poses", "reference", "--reference", log, "--json") == 0
    assert json.loads(capsys.readouterr().out)["absolute"]["position_m"]["max"] < 1e-9


def test_relations_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_tum(tmp_path / "line.tum", LINE)
    (tmp_path / "true.relations").write_text("0 2 1.3 0.4 0 0 0 0\n0 500 0 0 0 0 0 0\n")
    arguments = ("slam-eval", tmp_path / "line.tum", "--relations", tmp_path / "true.relations")
    assert command(*arguments, "--json") == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["absolute"], record["relative"], record["relations"]["known"]) == (None, [], 2)
    assert record["relations"]["pairs"] == 1
    assert record["relations"]["translation_m"]["mean"] == pytest.approx(0.5)
    assert command(*arguments) == 0
    assert "relations: 1 of 2 match the stamps" in capsys.readouterr().out


@pytest.mark.slow
def test_robots_of_a_run_have_true_poses(merged_run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command("slam-eval", merged_run, "--reference", merged_run, "--json") == 2
    assert "has 2 robots; choose with --robot: robot_0, robot_1" in capsys.readouterr().err
    assert command("slam-eval", merged_run, "--reference", merged_run, "--robot", "robot_1", "--json") == 0
    assert 0.0 < json.loads(capsys.readouterr().out)["absolute"]["position_m"]["rmse"] < 1.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "--reference or --relations: one of them must be given"),
        (("--reference", "line.tum", "--metres", 0), "--metres 0: must be positive"),
        (("--reference", "line.tum", "--max-difference", 0.001), "0 poses within 0.001 s of the reference"),
        (("--reference", "line.tum", "--poses", "slam"), "--poses slam: must be one of odometry, reference"),
        (("--reference", "none.tum"), "none.tum: No such file"),
        (("--reference", "picture.png"), "picture.png: no such file"),
    ],
)
def test_refusals(files: tuple[Path, Path], capsys, monkeypatch, options, message: str) -> None:  # type: ignore[no-untyped-def]
    monkeypatch.chdir(files[0].parent)
    assert command("slam-eval", "zigzag.tum", *options) == 2
    assert message in capsys.readouterr().err


def test_a_log_without_reference_poses_is_no_reference(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_carmen(tmp_path / "raw.log", room_log().log)
    assert command("slam-eval", tmp_path / "raw.log", "--reference", tmp_path / "raw.log") == 2
    assert "raw.log: has no reference poses" in capsys.readouterr().err
