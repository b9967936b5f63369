"""A merge of many maps that was interrupted continues, and its answer has the bytes of one that was not."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from benchmarks.team_injection.drawn_team import DrawnSettings, draw_team
from mapping.io.map_file import save_map
from mapquilt.jobs.runner import Runner
from mapquilt.merging.unfinished_merge import recording
from tests.conftest import command, hashes
from tests.processes import last_line, started, wait_for_entry
from worlds.families.registry import make_world

FAST = ("--workers", 1, "--set", "pair.explains_refusals=false")
JOURNAL = ".out.unfinished/.journal.jsonl"


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Seven maps of one office, one more than are merged without a journal."""
    team = draw_team(
        make_world("office", 3, 18.0, 12.0), DrawnSettings(maps=7, reach=4.0, range=4.0), np.random.default_rng(1)
    )
    folder = tmp_path_factory.mktemp("seven")
    for name, grid in zip(team.maps.names, team.maps.grids, strict=True):
        save_map(grid, folder / name)
    return [folder / f"{name}.yaml" for name in team.maps.names]


@contextmanager
def counting_tasks() -> Iterator[list[int]]:
    """Count the tasks that are really run, call after call."""
    numbers: list[int] = []
    completed = Runner.completed

    def counting(self, function, tasks):
        numbers.append(len(tasks))
        return completed(self, function, tasks)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Runner, "completed", counting)
        yield numbers


@pytest.fixture(scope="module")
def whole(maps: list[Path]) -> tuple[Path, int]:
    """The merge of the maps without an interruption, and the number of pairs that it matches first."""
    out = maps[0].parent / "out"
    with counting_tasks() as numbers:
        assert merge(maps, out) in (0, 1)
    assert [path.name for path in out.parent.glob(".*")] == []
    return out, numbers[0]


@pytest.fixture
def killed(maps: list[Path], tmp_path: Path) -> Path:
    """The folder of a merge that was killed after its first answers."""
    running = started("merge", *maps, *FAST, "--out", tmp_path / "out")
    wait_for_entry(tmp_path / JOURNAL, running)
    running.send_signal(signal.SIGKILL)
    running.communicate(timeout=60)
    assert not (tmp_path / "out").exists()
    return tmp_path / "out"


@pytest.fixture
def matched() -> Iterator[list[int]]:
    """Numbers of tasks that the test really runs, call after call."""
    with counting_tasks() as numbers:
        yield numbers


def merge(maps: list[Path], out: Path, *options: object) -> int:
    return command("merge", *maps, *FAST, *options, "--out", out)


def entries(out: Path) -> int:
    return (out.parent / JOURNAL).read_bytes().count(b"\n")


def test_a_killed_merge_continues_with_the_answers_that_it_had(whole, killed, maps, matched):
    known = entries(killed)
    assert known > 0
    assert merge(maps, killed) in (0, 1)
    assert matched[0] == whole[1] - known
    assert hashes(killed) == hashes(whole[0])
    assert [path.name for path in killed.parent.iterdir()] == ["out"]


def test_a_merge_with_another_seed_uses_no_answer_of_the_killed_one(whole, killed, maps, matched):
    assert merge(maps, killed, "--seed", 1) in (0, 1)
    assert matched[0] == whole[1]


def test_a_map_that_changed_is_matched_again_and_the_others_are_not(whole, killed, maps, matched, tmp_path):
    known = entries(killed)
    moved = tmp_path / "maps"
    shutil.copytree(maps[0].parent, moved, ignore=shutil.ignore_patterns("out"))
    shutil.copy(moved / maps[0].with_suffix(".pgm").name, moved / maps[6].with_suffix(".pgm").name)
    again = [moved / path.name for path in maps]
    assert merge(again, killed) in (0, 1)
    assert whole[1] - known <= matched[0] <= whole[1] - known + 6


def test_a_merge_on_a_full_disk_says_so_and_continues(whole, maps, matched, tmp_path):
    running = started("merge", *maps, *FAST, "--out", tmp_path / "out", file_bytes=8_000)
    assert ".journal.jsonl: File too large" in last_line(running)
    assert running.returncode == 2
    known = entries(tmp_path / "out")
    assert known > 0
    assert merge(maps, tmp_path / "out") in (0, 1)
    assert matched[0] == whole[1] - known
    assert hashes(tmp_path / "out") == hashes(whole[0])


def test_a_merge_that_is_interrupted_keeps_its_answers(maps, tmp_path):
    running = started("merge", *maps, *FAST, "--out", tmp_path / "out")
    wait_for_entry(tmp_path / JOURNAL, running)
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=60)
    assert running.returncode == 130
    assert entries(tmp_path / "out") > 0


def test_a_damaged_answer_is_named(killed, maps, capsys):
    journal = killed.parent / JOURNAL
    journal.write_bytes(b'{"task": "a", "pair": {"target": 1}}\n' + journal.read_bytes())
    assert merge(maps, killed) == 2
    assert f"{journal}: line 1: has no" in capsys.readouterr().err


def test_two_merges_into_one_folder_at_a_time_are_refused(maps, tmp_path, capsys):
    running = started("merge", *maps, *FAST, "--out", tmp_path / "out")
    wait_for_entry(tmp_path / JOURNAL, running)
    running.send_signal(signal.SIGSTOP)
    try:
        assert merge(maps, tmp_path / "out") == 2
        assert "another mapquilt process is writing into it" in capsys.readouterr().err
    finally:
        running.send_signal(signal.SIGCONT)
        assert running.wait(timeout=120) in (0, 1)
    assert (tmp_path / "out/merge.json").is_file()


def test_a_merge_that_fails_before_its_first_answer_leaves_nothing(tmp_path):
    with pytest.raises(ValueError, match="no answer"), recording(tmp_path / "out", Runner()):
        assert [path.name for path in tmp_path.iterdir()] == [".out.unfinished"]
        raise ValueError("no answer")
    assert list(tmp_path.iterdir()) == []
