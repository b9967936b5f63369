"""Robots, policies and overlap from the command line: records in the run, and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mapping.io.tum import load_tum
from mapquilt.cli.exit_status import NOT_REACHED
from mapquilt.cli.options.mission import MissionOptions, parse_mission
from mapquilt.runs.truth_file import load_truth
from sim.mission.file import load_mission
from sim.sensors.lidar import Lidar
from tests.conftest import command, hashes


def record(run: Path, name: str = "run") -> dict[str, object]:
    return dict(json.loads((run / f"{name}.json").read_text()))


def test_a_run_records_the_settings_of_its_mission(tmp_path: Path) -> None:
    (tmp_path / "team.yaml").write_text(
        "robots:\n- {start: [2.5, 10.0, 1.0], lidar: lds01, speed: 0.3}\n- {radius: 0.25, rate: 5}\n"
    )
    options = (
        "--robots-file",
        tmp_path / "team.yaml",
        "--drive",
        "wheels",
        "--starts",
        "spread",
        "--duration",
        3,
        "--seed",
        7,
    )
    assert command("simulate", "open_hall", *options, "--policy", "patrol", "--out", tmp_path / "run") == 0
    run = record(tmp_path / "run")
    assert (run["robots"], run["lidars"]) == (2, ["lds01", "default"])
    assert (run["drive"], run["starts"], run["policy"]) == ("wheels", "spread", "patrol")
    mission = load_mission(tmp_path / "run/mission")
    first, second = mission.settings.robots
    assert (first.limits.speed, first.lidar.range_max, second.radius, second.lidar.rate) == (0.3, 3.5, 0.25, 5.0)
    pose = mission.robots[0].trajectory.pose(0)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((2.5, 10.0, 1.0))
    assert run["overlap"]["ends_s"] == [3.0, 3.0]  # type: ignore[index]


def test_the_reached_overlap_is_recorded_and_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--robots", 2, "--duration", 10, "--starts", "close", "--overlap", "0.6:0.9")
    assert command("simulate", "office", *options, "--out", tmp_path / "run") == 0
    printed = capsys.readouterr()
    (pair,) = load_truth(tmp_path / "run/truth.json").pairs.values()
    run = record(tmp_path / "run")
    assert run["overlap"]["wanted"] == [0.6, 0.9]  # type: ignore[index]
    assert run["overlap"]["reached"] == [pair.footprints.overlap] * 2  # type: ignore[index]
    assert 0.6 <= pair.footprints.overlap <= 0.9
    assert "requested 0.6 to 0.9" in printed.out
    assert printed.err == ""


def test_the_reached_overlap_counts_beams_without_a_return(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ("--width", 15, "--height", 15, "--robots", 2, "--duration", 8, "--seed", 1)
    wanted = ("--overlap", "0.6:0.8", "--clear-range", 12)
    assert command("simulate", "outdoor", *options, *wanted, "--out", tmp_path / "run") == 0
    assert capsys.readouterr().err == ""
    reached = record(tmp_path / "run")["overlap"]["reached"]  # type: ignore[index]
    assert 0.6 <= min(reached) <= max(reached) <= 0.8
    seen = record(tmp_path / "run", "coverage")
    assert seen["robots"][0]["share"][-1] > 0.5  # type: ignore[index]


def test_an_unreachable_overlap_gives_a_status_a_warning_and_the_nearest_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = ("--start", "3,10", "--start", "26,10", "--overlap", "0.9:1", "--duration", 2, "--seed", 7)
    assert command("simulate", "office", *start, "--out", tmp_path / "run") == NOT_REACHED
    assert "overlap 0.9:1 was not reached: robot_0 and robot_1 overlap by" in capsys.readouterr().err
    assert record(tmp_path / "run")["overlap"]["reached"][0] < 0.9  # type: ignore[index]


def test_a_run_records_its_coverage(merged_run: Path) -> None:
    seen = record(merged_run, "coverage")
    team = np.array(seen["team"])
    assert seen["stamps_s"] == [float(k) for k in range(13)]
    assert (np.diff(team) >= 0.0).all()
    assert 0.05 < team[-1] <= 1.0
    assert [robot["name"] for robot in seen["robots"]] == ["robot_0", "robot_1"]  # type: ignore[attr-defined]


def test_a_run_can_be_replayed_from_its_own_truth(merged_run: Path, tmp_path: Path) -> None:
    assert command("convert", merged_run, tmp_path / "tum", "--to", "tum") == 0
    paths = [tmp_path / f"tum/robot_{k}/truth.tum" for k in range(2)]
    options = [word for path in paths for word in ("--replay", path)]
    world = merged_run / "mission/world.json"
    for name in ("run", "again"):
        assert command("simulate", world, *options, "--out", tmp_path / name) == 0
    assert record(tmp_path / "run")["policy"] == "replay"
    for path, truth in zip(paths, load_mission(tmp_path / "run/mission").robots, strict=True):
        assert truth.trajectory.poses[:, :2] == pytest.approx(load_tum(path).poses[:, :2], abs=1e-9)
    assert hashes(tmp_path / "run") == hashes(tmp_path / "again")


def test_omitted_fields_follow_from_the_options() -> None:
    plain = MissionOptions(None, None, Lidar(), "random", (), None, "velocity", 0.6, 1.5, None, (), (), None)
    settings, replay = parse_mission(plain)
    assert (len(settings.robots), settings.duration, settings.policy, replay) == (3, 120.0, "explore", ())
    starts = MissionOptions(
        None, None, Lidar(), "random", ("1,2", "3,4,0.5"), None, "velocity", 0.6, 1.5, None, ("1,1",), (), None
    )
    settings, _ = parse_mission(starts)
    assert [robot.start.yaw for robot in settings.robots if robot.start] == [0.0, 0.5]
    assert settings.policy == "patrol"


BAD = {
    "unknown.yaml": "robots: [{wings: 2}]\n",
    "start.yaml": "robots: [{}, {start: [1]}]\n",
    "empty.yaml": "robots: []\n",
    "speed.yaml": "robots: [{speed: fast}]\n",
    "short.tum": "0 1 1 0 0 0 0\n",
    "wall.tum": "0 2 10 0 0 0 0 1\n4.5 0.05 10 0 0 0 0 1\n",
}


@pytest.mark.parametrize(
    ("options", "messages"),
    [
        (("--start", "0.05,10"), ("start 0 at (0.05, 10)", "in a wall of world 'office'")),
        (("--start", "15,10,0", "--start", "15.2,10"), ("start 1 at (15.2, 10)", "overlaps start 0")),
        (("--start", "here"), ("--start here", "X,Y")),
        (("--start", "2,10", "--start", "5,10", "--robots", "1"), ("2 starts", "--robots 1")),
        (("--start", "nan,10"), ("nan",)),
        (("--policy", "patrol", "--goal", "99,1"), ("goal 0 at (99, 1)", "outside world 'office'")),
        (("--goal", "1"), ("--goal 1", "X,Y")),
        (("--goal", "0.05,3"), ("goal 0 at (0.05, 3)", "in a wall")),
        (("--overlap", "half"), ("--overlap half", "LO:HI")),
        (("--overlap", "0.9:0.1"), ("--overlap 0.9:0.1: must",)),
        (("--speed", "0"), ("--speed 0.0: must",)),
        (("--turn-rate", "-1"), ("--turn-rate -1.0: must",)),
        (("--drive", "legs"), ("legs", "wheels")),
        (("--policy", "replay"), ("replay holds 0 trajectories, but the policy is replay",)),
        (("--replay", "gone.tum"), ("gone.tum",)),
        (("--replay", "short.tum"), ("short.tum: line 1", "eight numbers")),
        (("--replay", "wall.tum"), ("replay of robot_0: at 4.5 s, (0.05, 10)", "in a wall")),
        (
            ("--replay", "wall.tum", "--robots", "2"),
            ("replay holds 1 trajectories, must hold one for each of 2 robots",),
        ),
        (("--robots-file", "unknown.yaml"), ("unknown.yaml: robot 0", "wings", "turn_rate")),
        (("--robots-file", "start.yaml"), ("start.yaml: robot 1", "start")),
        (("--robots-file", "empty.yaml"), ("empty.yaml", "robots")),
        (("--robots-file", "speed.yaml"), ("speed.yaml: robot 0", "fast")),
        (("--robots-file", "unknown.yaml", "--start", "1,1"), ("not in both",)),
    ],
)
def test_bad_missions_are_one_line_and_status_2(
    options: tuple[str, ...],
    messages: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name, text in BAD.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    assert command("simulate", "office", *options, "--out", "run") == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(each in error for each in messages), error
    assert not (tmp_path / "run").exists()
