"""Mission cache: each mission is simulated once, and damaged entries are simulated again."""

from __future__ import annotations

import dataclasses
import multiprocessing
import shutil
from pathlib import Path

import numpy as np
import pytest

import mapquilt.jobs.mission_cache as cache_module
from mapquilt.jobs.mission_cache import ROOMS, MissionCache, code_digest, mission_key
from sim.mission.mission import Mission
from sim.mission.settings import MissionSettings
from sim.mission.simulation import simulate
from worlds.families.registry import make_world

SETTINGS = MissionSettings(robots=1, duration=1.0)
WORLD = make_world("house", 3)


def assert_equal_missions(a: Mission, b: Mission) -> None:
    assert (a.seed, a.settings, a.contacts) == (b.seed, b.settings, b.contacts)
    for one, other in zip(a.robots, b.robots, strict=True):
        np.testing.assert_array_equal(one.trajectory.poses, other.trajectory.poses)
        np.testing.assert_array_equal(one.hits_robot, other.hits_robot)
        for scan, same in zip(one.scans, other.scans, strict=True):
            np.testing.assert_array_equal(scan.ranges, same.ranges)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cache") / "missions"
    assert not MissionCache(folder).mission(WORLD, SETTINGS, 5).found
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "missions"))


def entry(folder: Path) -> Path:
    (found,) = (path for path in folder.iterdir() if path.is_dir())
    return found


def test_a_mission_is_simulated_once_and_read_back_unchanged(folder, monkeypatch):
    def refuse(*arguments: object, **options: object) -> None:
        raise AssertionError("simulated again")

    monkeypatch.setattr(cache_module, "simulate", refuse)
    kept = MissionCache(folder).mission(WORLD, SETTINGS, 5)
    assert kept.found and kept.warning is None
    assert_equal_missions(kept.mission, simulate(WORLD, SETTINGS, 5)[0])


def test_the_key_depends_on_every_input_of_a_mission():
    longer = MissionSettings(robots=1, duration=1.5)
    other_lidar = dataclasses.replace(SETTINGS.robots[0], lidar=dataclasses.replace(SETTINGS.robots[0].lidar, rate=5.0))
    keys = [
        mission_key(WORLD, SETTINGS, 5),
        mission_key(WORLD, SETTINGS, 6),
        mission_key(make_world("house", 4), SETTINGS, 5),
        mission_key(WORLD, longer, 5),
        mission_key(WORLD, MissionSettings(robots=(other_lidar,), duration=1.0), 5),
    ]
    assert len(set(keys)) == len(keys)
    assert mission_key(WORLD, SETTINGS, 5, clear_range=3.0) == keys[0]
    cut = MissionSettings(robots=2, duration=1.0, overlap=(0.2, 0.4))
    assert mission_key(WORLD, cut, 5, clear_range=3.0) != mission_key(WORLD, cut, 5)


@pytest.mark.parametrize("name", ["robot_0.npz", "mission.json", "hashes.json"])
def test_a_damaged_entry_is_reported_and_simulated_again(folder, name):
    path = entry(folder) / name
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    made_again = MissionCache(folder).mission(WORLD, SETTINGS, 5)
    assert not made_again.found
    assert made_again.warning is not None and name in made_again.warning and str(entry(folder)) in made_again.warning
    assert path.read_bytes() == whole
    assert MissionCache(folder).mission(WORLD, SETTINGS, 5).found


def test_missing_and_partial_files_are_replaced(folder):
    (entry(folder) / "robot_0.npz").unlink()
    left = folder / f".{entry(folder).name}.0123456789abcdef.part"
    left.mkdir()
    for name in ("lock", "world.json"):
        (left / name).write_text("{")
    again = MissionCache(folder).mission(WORLD, SETTINGS, 5)
    assert again.warning is not None and "robot_0.npz" in again.warning
    assert not left.exists()


def _want(folder: Path, results: multiprocessing.Queue[bool]) -> None:
    results.put(MissionCache(folder).mission(WORLD, SETTINGS, 5).found)


def test_one_of_several_processes_simulates_a_mission(tmp_path):
    context = multiprocessing.get_context("fork")
    results: multiprocessing.Queue[bool] = context.Queue()
    workers = [context.Process(target=_want, args=(tmp_path / "new", results)) for _ in range(3)]
    for worker in workers:
        worker.start()
    found = sorted(results.get(timeout=120) for _ in workers)
    for worker in workers:
        worker.join()
    assert found == [False, True, True]


def test_a_folder_that_is_not_a_cache_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="no cache of missions"):
        MissionCache(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
    with pytest.raises(ValueError, match="is not a folder"):
        MissionCache(tmp_path / "notes.txt")
    other = tmp_path / "other"
    other.mkdir()
    (other / "cache.json").write_text('{"schema": "pip"}')
    with pytest.raises(ValueError, match="is not the mark"):
        MissionCache(other)


@pytest.mark.parametrize("room", ROOMS)
def test_an_edit_anywhere_below_a_package_changes_the_key(room, tmp_path):
    """A mission simulated by older code is another mission, however deep the edited file lies."""
    copy = shutil.copytree(Path(__file__).parents[3] / room, tmp_path / room)
    before = code_digest(copy)
    files = sorted(copy.rglob("*.py"))
    assert any(len(file.relative_to(copy).parts) > 1 for file in files)
    for file in files:
        text = file.read_text(encoding="utf-8")
        file.write_text(text + "\n", encoding="utf-8")
        assert code_digest(copy) != before, file
        file.write_text(text, encoding="utf-8")
    assert code_digest(copy) == before
    (copy / "moved.py").write_bytes(files[-1].read_bytes())
    assert code_digest(copy) != before
