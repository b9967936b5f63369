"""Faults of the machine while a data set is made: none becomes a sample's failure, and none a smaller data set."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from mapquilt.cli.exit_status import UNFINISHED
from mapquilt.dataset import make as make_module
from mapquilt.dataset.carried_plans import carry_plans
from mapquilt.dataset.group import Group, make_group
from mapquilt.dataset.make import Report, make_dataset
from mapquilt.dataset.plan import MissionPlan
from mapquilt.dataset.spec import load_spec
from mapquilt.jobs.runner import Pool, Runner, UnfinishedError, process_pool
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import refused

Make = Callable[[MissionPlan], Group]


def make_by(monkeypatch: pytest.MonkeyPatch, make: Make, spec: Path, out: Path, runner: Runner) -> Report:
    """Make a data set with missions made by another function."""
    monkeypatch.setattr(make_module, "make_group", make)
    return make_dataset(carry_plans(load_spec(str(spec))), out, runner)


def fail_on(number: int, error: BaseException, plan: MissionPlan) -> Group:
    if plan.index == number:
        raise error
    return make_group(plan)


def die_on_first(plan: MissionPlan) -> Group:
    if plan.index == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return make_group(plan)


def assert_continues(spec: Path, out: Path, tiny: Path) -> None:
    """Nothing tells of a failure, and the same command makes the same data set as without the fault."""
    assert not (out / "manifest.jsonl").exists()
    assert not (out / "failures.jsonl").exists()
    assert command("dataset", "make", spec, "--out", out, "--workers", 1) == 0
    assert hashes(out) == hashes(tiny)


def test_a_mission_whose_workers_are_killed_is_left_for_a_later_run(monkeypatch, tiny, spec_file, tmp_path):
    runner = Runner(start=lambda: Pool(process_pool(1), lambda: 2))
    with runner, pytest.raises(UnfinishedError, match=r"1 of 3 tasks were not done, the first is 0: its worker died"):
        make_by(monkeypatch, die_on_first, spec_file, tmp_path / "data", runner)
    assert sorted(path.name for path in (tmp_path / "data/missions").iterdir()) == ["00001", "00002"]
    monkeypatch.undo()
    assert_continues(spec_file, tmp_path / "data", tiny)


@pytest.mark.parametrize(
    ("error", "status", "says"),
    [
        (MemoryError(), UNFINISHED, "1 of 3 tasks were not done, the first is 1: memory was too short"),
        (OSError(errno.ENOSPC, "No space left on device", "/tmp/x"), 2, "/tmp/x: No space left on device"),
        (OSError("--scheduler tcp://head:1: is gone, with the tasks that it held"), 2, "is gone"),
        (TypeError("a mistake of the program"), 70, "internal error: TypeError: a mistake of the program"),
    ],
)
def test_only_a_refusal_is_recorded(monkeypatch, capsys, tiny, spec_file, tmp_path, error, status, says):
    monkeypatch.setattr(make_module, "make_group", partial(fail_on, 1, error))
    assert command("dataset", "make", spec_file, "--out", tmp_path / "data", "--workers", 1) == status
    assert says in capsys.readouterr().err.splitlines()[-1]
    monkeypatch.undo()
    assert_continues(spec_file, tmp_path / "data", tiny)


def test_a_refusal_is_recorded_with_its_cause_and_stays(monkeypatch, capsys, spec_file, tmp_path):
    monkeypatch.setattr(make_module, "make_group", partial(fail_on, 1, ValueError("the robots overlap")))
    for _ in range(2):
        assert command("dataset", "make", spec_file, "--out", tmp_path / "data", "--workers", 1) == 1
        assert "4 of 6 samples; 2 failed, see" in capsys.readouterr().out
        monkeypatch.undo()
    failures = [json.loads(line) for line in (tmp_path / "data/failures.jsonl").read_text().splitlines()]
    assert [(failure["sample"], failure["reason"]) for failure in failures] == [
        ("000002", "mission 00001: the robots overlap"),
        ("000003", "mission 00001: the robots overlap"),
    ]


def move(folder: Path) -> None:
    folder.rename(folder.with_name("elsewhere"))


def replace(folder: Path) -> None:
    move(folder)
    shutil.copytree(folder.with_name("elsewhere"), folder)


@pytest.mark.parametrize("change", [move, shutil.rmtree, replace])
@pytest.mark.parametrize("number", [0, 2])
def test_a_folder_that_is_moved_or_deleted_meanwhile_is_an_error(
    monkeypatch, capsys, spec_file, tmp_path, change, number
):
    out = tmp_path / "data"

    def make(plan: MissionPlan) -> Group:
        if plan.index == number:
            change(out)
        return make_group(plan)

    monkeypatch.setattr(make_module, "make_group", make)
    line = refused(capsys, "dataset", "make", spec_file, "--out", out, "--workers", 1)
    assert f"{out}: was moved or deleted during the work" in line
    assert change is replace or not out.exists()


def test_a_sample_that_is_deleted_meanwhile_is_an_error_and_made_again(monkeypatch, capsys, tiny, spec_file, tmp_path):
    out = tmp_path / "data"

    def make(plan: MissionPlan) -> Group:
        if plan.index == 2:
            shutil.rmtree(out / "samples/000001")
        return make_group(plan)

    monkeypatch.setattr(make_module, "make_group", make)
    line = refused(capsys, "dataset", "make", spec_file, "--out", out, "--workers", 1)
    assert "samples/000001/" in line and "was removed after it was made" in line
    monkeypatch.undo()
    assert_continues(spec_file, out, tiny)


def test_a_finished_data_set_that_lacks_a_sample_is_not_called_whole(capsys, tiny, spec_file, tmp_path):
    out = Path(shutil.copytree(tiny, tmp_path / "data"))
    shutil.rmtree(out / "samples/000004")
    assert "samples/000004/" in refused(capsys, "dataset", "make", spec_file, "--out", out)


@pytest.mark.parametrize("task", ["0", "99"])
def test_an_entry_of_a_journal_that_tells_of_no_sample_hides_none(tiny, spec_file, tmp_path, task):
    out = Path(shutil.copytree(tiny, tmp_path / "data"))
    (out / "manifest.jsonl").unlink()
    (out / ".journal.jsonl").write_text(json.dumps({"task": task, "records": [], "failures": []}) + "\n")
    assert command("dataset", "make", spec_file, "--out", out, "--workers", 1) == 0
    assert hashes(out) == hashes(tiny)


@pytest.mark.parametrize(
    "line", ['{"group": 99, "records": [], "failures": []}', "[]", '"x"', '{"task": "0"}',
             '{"task": "0", "records": [{}], "failures": []}', '{"task": "0", "records": [], "failures": [7]}']
)  # fmt: skip
def test_a_line_that_is_no_entry_is_named(capsys, tiny, spec_file, tmp_path, line):
    out = Path(shutil.copytree(tiny, tmp_path / "data"))
    (out / "manifest.jsonl").unlink()
    (out / ".journal.jsonl").write_text(line + "\n")
    assert ".journal.jsonl: " in refused(capsys, "dataset", "make", spec_file, "--out", out, "--workers", 1)
