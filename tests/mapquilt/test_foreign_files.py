"""No verb touches what it did not write: other people's files, folders and links in its output folder stay."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from mapping.io.map_file import load_map, save_map
from mapping.io.transaction import LEDGER_FILE, written_files
from tests.conftest import command


def snapshot(folder: Path) -> dict[str, bytes | str]:
    """Every file below a folder by its bytes, and every link by its target, without following one."""
    found: dict[str, bytes | str] = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink():
            found[name] = str(path.readlink())
        elif path.is_file():
            found[name] = path.read_bytes()
    return found


def settle(folder: Path, victim: Path) -> dict[str, bytes | str]:
    """Put files, folders and links of somebody else into a folder, and return their snapshot."""
    for name in ("notes.txt", "robot_0/my-notes.txt", "inputs/mine.jpg", "inputs/7/photo.jpg", "sheets/own.png"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"mine: {name}")
    (folder / "album").mkdir()
    (folder / "album/merged_9.yaml").write_text("mine")
    (folder / "conflicts_8.pgm").write_text("mine, although the name is like ours")
    (folder / "victim").symlink_to(victim)
    (folder / "inputs/victim").symlink_to(victim)
    (folder / "letter").symlink_to(victim / "letter.txt")
    mine = ("mine", "notes", "photo", "own", "merged_9", "conflicts_8", "victim", "letter")
    return {name: content for name, content in snapshot(folder).items() if any(word in name for word in mine)}


@pytest.fixture
def victim(tmp_path: Path) -> Path:
    """A folder of somebody else, outside all outputs."""
    folder = tmp_path / "victim"
    (folder / "photos").mkdir(parents=True)
    (folder / "letter.txt").write_text("dear")
    (folder / "photos/a.jpg").write_text("photo")
    return folder


@pytest.fixture
def two_maps(merged_run: Path) -> list[Path]:
    return [merged_run / f"robot_{index}" / "map.yaml" for index in range(2)]


@pytest.fixture
def pairs(merged_run: Path, tmp_path: Path) -> Path:
    """A list of one pair, whose maps lie in the folder that the benchmark writes."""
    for index in range(2):
        grid = load_map(merged_run / f"robot_{index}/map.yaml").grid
        (tmp_path / "out/maps").mkdir(parents=True, exist_ok=True)
        save_map(grid, tmp_path / f"out/maps/{index}")
    truth = {"scale": 1.0, "rotation_deg": 0.0, "tx": 0.0, "ty": 0.0}
    entry = {"name": "$_$ in a name", "kind": "cut", "map_a": "out/maps/0.yaml", "map_b": "out/maps/1.yaml", **truth}
    (tmp_path / "pairs.json").write_text(json.dumps({"pairs": [entry]}))
    return tmp_path / "pairs.json"


SIMULATE = ("simulate", "office", "--robots", 2, "--duration", 4, "--seed", 5)


def test_the_verbs_of_a_run(fresh_run: Path, merged_run: Path, victim: Path, two_maps: list[Path]) -> None:
    outside, theirs = snapshot(victim), settle(fresh_run, victim)
    for verb in (
        ("merge", fresh_run),
        ("score", fresh_run),
        ("report", fresh_run),
        ("merge", fresh_run, "--seed", 3, "--min-confidence", 0.05),
        ("sense", merged_run, "--out", fresh_run, "--noise", 2),
        ("merge", fresh_run),
        ("merge", fresh_run, "--add", two_maps[0], "--force"),
        (*SIMULATE, "--out", fresh_run),
    ):
        assert command(*verb) in (0, 1), verb
        now = snapshot(fresh_run)
        assert {name: now.get(name) for name in theirs} == theirs, verb
        assert snapshot(victim) == outside, verb
    names = {name for name in snapshot(fresh_run) if name not in theirs}
    assert names == written_files(fresh_run) | {LEDGER_FILE}  # and all of the older runs and merges is gone
    assert not names & {"merge.json", "score.json", "report.html"}


def test_merge_to_a_folder(two_maps: list[Path], tmp_path: Path, victim: Path) -> None:
    out = tmp_path / "merged"
    for index, path in enumerate(two_maps):  # of different names
        save_map(load_map(path).grid, tmp_path / f"floor_{index}")
    merge = ("merge", tmp_path / "floor_0.yaml", tmp_path / "floor_1.yaml", "--out", out)
    assert command(*merge) in (0, 1)
    outside, theirs = snapshot(victim), settle(out, victim)
    for verb in (merge, ("merge", out, "--add", tmp_path / "floor_1.yaml", "--force"), merge):
        assert command(*verb) in (0, 1)
        now = snapshot(out)
        assert {name: now.get(name) for name in theirs} == theirs, verb
        assert snapshot(victim) == outside
    assert not (out / "inputs/2").exists()  # the copy that --add made is ours, and its folder


def test_a_benchmark_keeps_inputs_in_its_folder(pairs: Path, tmp_path: Path, victim: Path) -> None:
    out = tmp_path / "out"
    benchmark = ("benchmark", "--pairs", pairs, "--method", "orb", "--out", out)
    maps = snapshot(out / "maps")
    shutil.move(out, tmp_path / "aside")
    shutil.copytree(tmp_path / "aside/maps", tmp_path / "elsewhere/out/maps")
    shutil.copy(pairs, tmp_path / "elsewhere")
    first = ("benchmark", "--pairs", tmp_path / "elsewhere/pairs.json", "--method", "orb", "--out", out)
    assert command(*first) == 0
    shutil.copytree(tmp_path / "aside/maps", out / "maps")
    outside, theirs = snapshot(victim), settle(out, victim)
    assert command(*benchmark) == 0
    now = snapshot(out)
    assert {name: now.get(name) for name in theirs} == theirs
    assert snapshot(out / "maps") == maps
    assert snapshot(victim) == outside
    assert not (tmp_path / ".out.unfinished").exists()


@pytest.mark.parametrize("place", ["mission", "truth", "robot_0", "robot_1"])
def test_nothing_is_written_through_a_link(fresh_run: Path, victim: Path, place: str, capsys) -> None:
    shutil.rmtree(fresh_run / place)
    (fresh_run / place).symlink_to(victim)
    outside, before = snapshot(victim), snapshot(fresh_run)
    assert command(*SIMULATE, "--out", fresh_run) == 2
    assert f"{fresh_run / place}: is a link, through which nothing is written" in capsys.readouterr().err
    assert snapshot(victim) == outside
    assert snapshot(fresh_run) == before


@pytest.mark.parametrize("target", ["victim", "victim/photos"])
def test_inputs_that_are_a_link_stay(fresh_run: Path, victim: Path, target: str, two_maps: list[Path], capsys) -> None:
    outside = snapshot(victim)
    (fresh_run / "inputs").symlink_to(victim.parent / target)
    assert command("merge", fresh_run) in (0, 1)
    assert snapshot(victim) == outside
    assert command("merge", fresh_run, "--add", two_maps[0], "--force") == 2
    assert "inputs: is a link" in capsys.readouterr().err
    assert snapshot(victim) == outside
    assert os.path.lexists(fresh_run / "inputs")


@pytest.mark.parametrize("to", ["tum", "carmen"])
def test_convert_writes_into_no_folder_of_others(fresh_run: Path, tmp_path: Path, victim: Path, to: str) -> None:
    outside = snapshot(victim)
    (tmp_path / "link").symlink_to(victim)
    for out in (victim, tmp_path / "link"):
        assert command("convert", fresh_run, out, "--to", to) == 2
        assert snapshot(victim) == outside


def test_a_list_of_files_names_nothing_outside(fresh_run: Path, victim: Path) -> None:
    (fresh_run / "link").symlink_to(victim)
    listed = json.loads((fresh_run / LEDGER_FILE).read_text())
    listed["files"] += ["../victim/letter.txt", str(victim / "letter.txt"), "link/letter.txt", "link/photos/a.jpg"]
    (fresh_run / LEDGER_FILE).write_text(json.dumps(listed))
    outside = snapshot(victim)
    assert command(*SIMULATE, "--out", fresh_run) == 0
    assert snapshot(victim) == outside


SPEC = """
name: tiny
seed: 1
missions: [{world: house, count: 1, robots: 2, duration: 3}]
samples: {per_mission: 1, poses: [odometry]}
splits: {test: 1.0}
"""
STUDY = ("--vary", "noise=0,1", "--set", "robots=2", "--set", "duration=3", "--method", "orb", "--missions", 1)


@pytest.fixture
def jobs(tmp_path: Path) -> dict[str, tuple[object, ...]]:
    """The commands that continue an unfinished job, each for the folder ``out``."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    return {
        "spec.json": ("dataset", "make", tmp_path / "spec.yaml", "--out", tmp_path / "out", "--workers", 1),
        "plan.json": ("study", *STUDY, "--out", tmp_path / "out", "--workers", 1),
    }


@pytest.mark.parametrize("mark", ["spec.json", "plan.json"])
def test_jobs_keep_what_lies_in_their_folder(jobs, tmp_path: Path, victim: Path, mark: str) -> None:
    out = tmp_path / "out"
    outside = snapshot(victim)
    theirs = settle(out, victim)
    assert command(*jobs[mark]) == 2  # not empty, and not its own
    assert (snapshot(out), snapshot(victim)) == (theirs | snapshot(out), outside)
    shutil.rmtree(out)
    assert command(*jobs[mark]) == 0
    assert (out / mark).is_file()
    theirs = settle(out, victim)
    for verb in (jobs[mark], ("report", out), *([("merge", out, "--workers", 1)] if mark == "spec.json" else [])):
        assert command(*verb) in (0, 1), verb
        now = snapshot(out)
        assert {name: now.get(name) for name in theirs} == theirs, verb
        assert snapshot(victim) == outside
    if mark == "spec.json":
        before = snapshot(out)
        assert command("dataset", "verify", out, "--repair") == 1  # it names what is in no record
        assert snapshot(out) == before


@pytest.mark.parametrize("place", ["samples/000000", "samples", "missions"])
def test_jobs_write_nothing_through_a_link(jobs, tmp_path: Path, victim: Path, place: str) -> None:
    """A link in the place of a folder, when an interrupted job continues."""
    out, outside = tmp_path / "out", snapshot(victim)
    out.mkdir()
    assert command(*jobs["spec.json"]) == 0
    if place != "missions":
        shutil.copytree(out, whole := tmp_path / "whole")
        shutil.rmtree(whole / place)
        shutil.copytree(out / place, victim / "copy")
        (whole / place).symlink_to(victim / "copy")
        copied = snapshot(victim)
        assert command("merge", whole) == 2
        assert snapshot(victim) == copied
        shutil.rmtree(victim / "copy")
    (out / "manifest.jsonl").unlink()
    shutil.rmtree(out / place)
    (out / place).symlink_to(victim)
    assert command(*jobs["spec.json"]) == 2
    assert command("dataset", "verify", out, "--repair") == 2
    assert snapshot(victim) == outside


def test_other_verbs_that_write_a_folder(fresh_run: Path, tmp_path: Path, victim: Path) -> None:
    out, log = tmp_path / "out", fresh_run / "robot_0/log.npz"
    for verb in (
        ("slam-eval", fresh_run, "--robot", "robot_0", "--reference", fresh_run, "--out", out),
        ("map", log, "--out", out),
    ):
        assert command(*verb) == 0
        outside, theirs = snapshot(victim), settle(out, victim)
        assert command(*verb) == 0
        now = snapshot(out)
        assert {name: now.get(name) for name in theirs} == theirs, verb
        assert snapshot(victim) == outside
        shutil.rmtree(out)
        settle(out, victim)
        theirs = snapshot(out)
        assert command(*verb) == 2
        assert snapshot(out) == theirs
        shutil.rmtree(out)


def test_a_world_replaces_one_file(tmp_path: Path, victim: Path) -> None:
    out = tmp_path / "out"
    theirs, outside = settle(out, victim), snapshot(victim)
    for verb in (("make", "house", "--out", out / "house.json"), ("show", "house", "--out", out / "house.png")):
        assert command("worlds", *verb) == 0
        assert {name: snapshot(out).get(name) for name in theirs} == theirs
    assert set(snapshot(out)) == {*theirs, "house.json", "house.png"}
    assert command("worlds", "make", "house", "--out", out / "victim") == 2  # a link to a folder
    assert snapshot(victim) == outside
