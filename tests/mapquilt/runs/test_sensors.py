"""Lidars and single noise components, from the command line to the files and back."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from mapping.io.robot_log_file import load_robot_log
from sim.mission.file import load_mission
from sim.sensors.adversity.settings import AMOUNTS, LEVEL_ONE
from sim.sensors.lidar_presets import PRESETS, lidar_preset
from sim.sensors.noise import Noise
from sim.sensors.sensing import sense
from tests.conftest import command


@pytest.fixture(scope="module")
def lds01_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("runs") / "lds01"
    options = ("--robots", 1, "--duration", 3, "--seed", 3, "--lidar", "lds01", "--rate", 4)
    assert command("simulate", "office", *options, "--out", run) == 0
    return run


def log_ranges(run: Path) -> np.ndarray:
    return np.array([scan.ranges for scan in load_robot_log(run / "robot_0/log.npz").scans])


def expected_ranges(run: Path, noise: Noise) -> np.ndarray:
    mission = load_mission(run / "mission")
    return np.array([scan.ranges for scan in sense(mission.robots[0], noise, 3, 0).log.scans])


def test_a_run_carries_its_lidar_and_is_sensed_with_its_noise(lds01_run: Path) -> None:
    lidar = load_mission(lds01_run / "mission").settings.robots[0].lidar
    assert (lidar.model, lidar.rate, lidar.range_max) == ("lds01", 4.0, 3.5)
    assert json.loads((lds01_run / "run.json").read_text())["lidars"] == ["lds01"]
    noise = Noise.level(1.0, lidar_preset("lds01").noise)
    assert np.array_equal(log_ranges(lds01_run), expected_ranges(lds01_run, noise))
    assert not np.array_equal(log_ranges(lds01_run), expected_ranges(lds01_run, Noise()))


def test_sense_keeps_the_lidars_noise_and_sets_components_after_the_level(lds01_run: Path, tmp_path: Path) -> None:
    alone = ("--set", "lidar.range_sigma=0.05", "--set", "odometry.alpha1=0.5")
    assert command("sense", lds01_run, "--noise", 2, *alone, "--out", tmp_path / "run") == 0
    record = json.loads((tmp_path / "run/run.json").read_text())
    assert record["lidars"] == ["lds01"]
    assert (record["noise"], record["noise_components"]) == (
        2.0,
        {"lidar.range_sigma": 0.05, "odometry.alpha1": 0.5},
    )
    noise = Noise.level(2.0, lidar_preset("lds01").noise)
    noise = noise.with_fields([("lidar.range_sigma", 0.05), ("odometry.alpha1", 0.5)])
    assert np.array_equal(log_ranges(tmp_path / "run"), expected_ranges(lds01_run, noise))


def test_lidars_are_listed_with_their_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert command("lidars") == 0
    listed = capsys.readouterr().out
    lines, unfolded = listed.splitlines(), " ".join(listed.split())
    for preset in PRESETS:
        assert [line.split()[0] for line in lines if line.startswith((f" {preset.name} ", f"{preset.name}:"))] == [
            preset.name,  # its numbers
            f"{preset.name}:",  # its noise, above its sources
        ]
        for source in preset.sources:
            assert source in unfolded
    header = next(line for line in lines if line.split()[:1] == ["lidar"])
    for preset, line in zip(PRESETS, lines[lines.index(header) + 2 :], strict=False):
        assert line[header.index("beams") :].split()[0] == str(preset.lidar.beams)


@pytest.mark.parametrize(
    ("options", "messages"),
    [
        (("--lidar", "velodyne"), ("'velodyne'", "rplidar_a1", "thesis")),
        (("--lidar", "lds01", "--rate", "6"), ("6.0 Hz", "lds01")),
        (("--noise", "-1"), ("--noise -1.0: must lie",)),
        (("--set", "lidar.range_sigma=-0.1"), ("lidar.range_sigma=-0.1", "range_sigma is -0.1")),
        (("--set", "lidar.dropout=1.5"), ("lidar.dropout=1.5", "at most 1")),
        (("--set", "lidar.range_sigma=much"), ("lidar.range_sigma=much", "no number")),
        (("--set", "lidar.range_sigma=nan"), ("lidar.range_sigma=nan", "no number")),
        (("--set", "lidar.range_sigma"), ("--set lidar.range_sigma", "NAME=VALUE")),
        (("--set", "lidar.sigma=1"), ("--set lidar.sigma=1: lidar.sigma is no setting", "bias_sigma")),
    ],
)
def test_bad_options_are_one_line_and_status_2(
    options: tuple[str, ...], messages: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("simulate", "office", *options, "--out", tmp_path / "run") == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(each in error for each in messages), error
    assert not (tmp_path / "run").exists()


def test_a_mission_of_an_unknown_lidar_is_refused_by_its_name(
    lds01_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = Path(shutil.copytree(lds01_run, tmp_path / "old"))
    path = run / "mission/mission.json"
    path.write_text(path.read_text().replace('"lds01"', '"lds99"'))
    assert command("sense", run, "--out", tmp_path / "new") == 2
    assert "'lds99' is unknown; known are default" in capsys.readouterr().err


def test_adversity_is_switched_on_by_name_or_level_and_is_the_same_each_time(lds01_run: Path, tmp_path: Path) -> None:
    clean, first, again, level = (tmp_path / name for name in ("clean", "first", "again", "level"))
    people = ("--set", "adversity.people=30", "--set", "sensing.adversity.personal_space=0.3")
    assert command("sense", lds01_run, "--out", clean) == 0
    assert command("sense", lds01_run, *people, "--out", first) == 0
    assert command("sense", lds01_run, *people, "--out", again) == 0
    assert command("sense", lds01_run, "--set", "sensing.adversity.level=2", "--out", level) == 0
    assert (log_ranges(first) < log_ranges(clean)).any()
    assert (first / "robot_0/log.npz").read_bytes() == (again / "robot_0/log.npz").read_bytes()
    components = json.loads((level / "run.json").read_text())["noise_components"]
    assert components == {f"adversity.{name}": 2.0 * getattr(LEVEL_ONE, name) for name in AMOUNTS}


def test_a_bad_adversity_is_refused_before_anything_is_written(
    lds01_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("sense", lds01_run, "--set", "adversity.glass=2", "--out", tmp_path / "run") == 2
    assert "--set adversity.glass=2: Adversity: glass is 2.0, must lie between 0 and 1" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
