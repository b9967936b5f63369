"""Missions on disk: exact round trips and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sim.mission.file import load_mission, save_mission
from sim.mission.mission import Mission
from sim.mission.settings import CutSettings
from sim.navigation.settings import NavigationSettings, SteeringSettings
from sim.policies.settings import BehaviourSettings


@pytest.fixture
def folder(mission: Mission, tmp_path: Path) -> Path:
    save_mission(mission, tmp_path / "mission")
    return tmp_path / "mission"


def test_a_mission_round_trip_is_exact(mission: Mission, folder: Path, tmp_path: Path) -> None:
    again = load_mission(folder)
    assert (again.world, again.seed, again.settings) == (mission.world, mission.seed, mission.settings)
    assert again.contacts == mission.contacts
    for mine, theirs in zip(again.robots, mission.robots, strict=True):
        assert np.array_equal(mine.trajectory.poses, theirs.trajectory.poses)
        assert np.array_equal(mine.hits_robot, theirs.hits_robot)
        assert mine.base_from_lidar == theirs.base_from_lidar
        for a, b in zip(mine.scans, theirs.scans, strict=True):
            assert np.array_equal(a.ranges, b.ranges)
            assert (a.stamp, a.angle_min, a.angle_increment) == (b.stamp, b.angle_min, b.angle_increment)
            assert (a.range_min, a.range_max) == (b.range_min, b.range_max)
    save_mission(again, tmp_path / "again")
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes()


def test_the_policy_tour_of_older_files_is_read_as_patrol(folder: Path) -> None:
    path = folder / "mission.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    record["settings"]["policy"] = "tour"
    path.write_text(json.dumps(record), encoding="utf-8")
    assert load_mission(folder).settings.policy == "patrol"


def test_tuning_is_stored_where_it_differs_from_the_default(mission: Mission, folder: Path, tmp_path: Path) -> None:
    assert not {"behaviour", "cut"} & set(json.loads((folder / "mission.json").read_text())["settings"])
    navigation = NavigationSettings(lookahead=(0.3, 0.8), steering=SteeringSettings(steps=10))
    settings = replace(mission.settings, behaviour=BehaviourSettings(navigation), cut=CutSettings(levels=30))
    save_mission(replace(mission, settings=settings), tmp_path / "tuned")
    assert load_mission(tmp_path / "tuned").settings == settings


@pytest.mark.parametrize("value", [1, [], {"unknown": 1.0}, {"navigation": {"steering": {"steps": 0}}}])
def test_malformed_tuning_is_named(folder: Path, value: object) -> None:
    path = folder / "mission.json"
    record = json.loads(path.read_text(encoding="utf-8"))
    record["settings"]["behaviour"] = value
    path.write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(ValueError, match=r"mission\.json: malformed"):
        load_mission(folder)


@pytest.mark.parametrize("name", ["world.json", "mission.json", "robot_1.npz"])
def test_a_missing_file_is_named(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(OSError, match=name):
        load_mission(folder)


@pytest.mark.parametrize("name", ["world.json", "mission.json", "robot_1.npz"])
@pytest.mark.parametrize("damage", ["empty", "cut", "other"])
def test_a_damaged_file_is_named(folder: Path, name: str, damage: str) -> None:
    content = (folder / name).read_bytes()
    (folder / name).write_bytes({"empty": b"", "cut": content[: len(content) // 2], "other": b"[1, 2]"}[damage])
    with pytest.raises(ValueError, match=name):
        load_mission(folder)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("version", 99),
        ("settings", {}),
        ("seed", None),
        ("settings", {"robots": 0}),
        ("touches", 3),
        ("seed", -1),
        ("seed", 1.5),
        ("seed", True),
        ("touches", [-1]),
        ("colour", "red"),
    ],
)
def test_a_malformed_record_is_named(folder: Path, field: str, value: object) -> None:
    path = folder / "mission.json"
    record = json.loads(path.read_text())
    path.write_text(json.dumps({**record, field: value}))
    with pytest.raises(ValueError, match=r"mission\.json"):
        load_mission(folder)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("world_from_base", lambda poses: poses * 1e300),
        ("world_from_base", lambda poses: poses - 100.0),
        ("ranges", lambda ranges: ranges[:, 1:]),
        ("ranges", lambda ranges: ranges.astype(complex)),
        ("stamps", lambda stamps: stamps.astype(str)),
    ],
)
def test_invalid_arrays_are_refused_by_name(folder: Path, name: str, change: Callable[[Any], Any]) -> None:
    path = folder / "robot_1.npz"
    with np.load(path) as archive:
        arrays = dict(archive)
    np.savez(path, **{**arrays, name: change(arrays[name])})
    with pytest.raises(ValueError, match=r"robot_1\.npz: "):
        load_mission(folder)


def test_an_unknown_lidar_is_refused_by_name(folder: Path) -> None:
    record = json.loads((folder / "mission.json").read_text())
    record["settings"]["robots"][0]["lidar"]["model"] = "magic"
    (folder / "mission.json").write_text(json.dumps(record))
    with pytest.raises(ValueError, match=r"mission\.json: .*magic"):
        load_mission(folder)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"base_from_lidar": {"x": 5.0, "y": 0.0, "yaw": 0.0}}, "outside the world"),
        ({"angle_min": 1.0}, "the end of a beam is at .* outside the world"),
    ],
)
def test_a_lidar_that_leaves_the_world_is_refused(folder: Path, change: dict[str, Any], fault: str) -> None:
    record = json.loads((folder / "mission.json").read_text())
    for robot in record["settings"]["robots"]:
        robot["lidar"] |= change
    (folder / "mission.json").write_text(json.dumps(record))
    with pytest.raises(ValueError, match=rf"robot_0\.npz: scan \d+: .*{fault}"):
        load_mission(folder)
