"""``--mapper particle``: runs from end to end, random numbers of each robot's own, and refusals."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from mapping.particle.settings import ParticleSettings
from mapping.settings import MappingSettings
from mapquilt.json_file import read_record
from mapquilt.runs import folder as run_folder
from mapquilt.runs.sample import make_sample
from mapquilt.runs.truth_file import load_truth
from mapquilt.settings import SampleSettings
from sim.mission.file import load_mission
from sim.sensors.settings import SensingSettings
from tests.conftest import command, hashes

FEW = ("--set", "particles=4")


def test_a_run_by_the_particle_filter_is_merged_and_scored(tmp_path: Path) -> None:
    run = tmp_path / "run"
    simulated = ("simulate", "office", "--robots", 2, "--duration", 12, "--seed", 3, "--mapper", "particle", *FEW)
    assert command(*simulated, "--out", run) == 0
    record = read_record(run / "run.json", "run")
    assert (record["poses"], record["sensor_model"]) == ("particle", "counting")
    assert command("merge", run) in (0, 1)
    assert command("score", run) == 0
    for robot in load_truth(run / run_folder.TRUTH_FILE).robots:
        assert robot.truth.distortion < 0.1


def test_the_same_seed_gives_the_same_run_and_the_default_mapper_another(merged_run: Path, tmp_path: Path) -> None:
    for name in ("one", "again"):
        assert command("sense", merged_run, "--mapper", "particle", *FEW, "--out", tmp_path / name) == 0
    assert hashes(tmp_path / "one") == hashes(tmp_path / "again")
    assert hashes(tmp_path / "one")["robot_0/map.pgm"] != hashes(merged_run)["robot_0/map.pgm"]
    assert hashes(tmp_path / "one")["robot_0/log.npz"] == hashes(merged_run)["robot_0/log.npz"]


def test_each_robot_has_random_numbers_of_its_own(merged_run: Path) -> None:
    """A robot and its double, which drove the same way and saw exactly the same, get different maps."""
    mission = load_mission(merged_run / "mission")
    settings = dataclasses.replace(mission.settings, robots=mission.settings.robots[:1] * 2)
    mission = dataclasses.replace(mission, robots=mission.robots[:1] * 2, settings=settings)
    mapping = MappingSettings(mapper="particle", particle=ParticleSettings(particles=2))
    one, double = make_sample(mission, SampleSettings(SensingSettings(0.0), mapping)).maps.grids
    assert not np.array_equal(one.log_odds, double.log_odds)


def test_a_log_is_mapped_with_its_times(merged_run: Path, tmp_path: Path) -> None:
    log = merged_run / "robot_0" / "log.npz"
    assert command("map", log, "--mapper", "particle", *FEW, "--out", tmp_path / "map") == 0
    record = read_record(tmp_path / "map" / "map.json", "map")
    assert (record["poses"], record["sensor_model"]) == ("particle", "counting")
    assert record["settings"] == {"mapper": "particle", "particle.particles": 4}
    assert set(run_folder.read_timings(tmp_path / "map")["map"]) == {"match", "draw"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--mapper", "particle", "--poses", "slam"), "--poses slam: must be left out with mapper particle"),
        (("--set", "mapper=particle", "--poses", "slam"), "--poses slam: must be left out with mapper particle"),
        (("--mapper", "particle", "--poses", "truth"), "poses is 'truth', but mapper particle estimates its own"),
        (("--mapper", "particle", "--model", "hector"), "sensor_model is 'hector', but mapper particle counts hits"),
        (("--mapper", "gmapping"), "--mapper 'gmapping': must be one of log-odds, particle"),
    ],
)
def test_contradictions_are_refused_before_anything_is_written(
    options: tuple[str, ...], words: str, merged_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command("sense", merged_run, *options, "--out", tmp_path / "run") == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_map_refuses_poses_of_its_own(merged_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for poses in ("slam", "reference"):
        options = ("--mapper", "particle", "--poses", poses, "--out", tmp_path / "map")
        assert command("map", merged_run / "robot_0" / "log.npz", *options) == 2
    assert "--poses slam: must be left out with mapper particle" in capsys.readouterr().err
    assert not (tmp_path / "map").exists()
