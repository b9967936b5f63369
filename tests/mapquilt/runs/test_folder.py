"""Edited runs: each file is checked when it is read, and refused in one line by its name."""

import json
from pathlib import Path

import pytest

from mapquilt.runs import folder as run_folder
from mapquilt.runs.truth_file import load_truth
from tests.conftest import command


def refused(capsys, *arguments):
    """The one line with which a call is refused."""
    capsys.readouterr()
    assert command(*arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line.removeprefix("mapquilt: ")


def edit(path, change):
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))


@pytest.mark.parametrize(
    "file",
    ["../elsewhere/map.yaml", "truth/robot_0.yaml", "./robot_0/../truth/robot_0.yaml", "mission/map.yaml", "/map.yaml"],
)
def test_the_merger_reads_only_maps_of_the_run_and_no_truth(fresh_run, capsys, file):
    edit(fresh_run / "maps.json", lambda record: record["maps"][0].update(file=file))
    line = refused(capsys, "merge", fresh_run)
    assert line.startswith(f"{fresh_run / 'maps.json'}: file is {file!r}")


@pytest.mark.parametrize("name", ["../x", "..", "a/b", "robot_0\n", "", " ", "robot_1"])
def test_names_of_maps_are_plain_and_unique(fresh_run, capsys, name):
    edit(fresh_run / "maps.json", lambda record: record["maps"][0].update(name=name))
    assert refused(capsys, "merge", fresh_run).startswith(f"{fresh_run / 'maps.json'}: ")


@pytest.mark.parametrize(
    ("file", "verb"),
    [
        ("run.json", "merge"),
        ("maps.json", "merge"),
        ("truth.json", "score"),
        ("merge.json", "score"),
        ("timings.json", "merge"),
        ("mission/mission.json", "score"),
        ("mission/world.json", "score"),
    ],
)
@pytest.mark.parametrize(
    "text", ["[]", "", '{"x": NaN}', "[" * 100_000, '{"a":' * 800 + "1" + "}" * 800, '{"schema": ' + "9" * 5000 + "}"]
)
def test_a_file_that_is_not_a_record_is_named(fresh_run, capsys, file, verb, text):
    (fresh_run / file).write_text(text)
    assert refused(capsys, verb, fresh_run).startswith(f"{fresh_run / file}: ")


@pytest.mark.parametrize("value", ["1e308", "1e-320", "-1", "9" * 40])
def test_an_absurd_scale_is_refused_by_name(fresh_run, capsys, value):
    text = (fresh_run / "truth.json").read_text()
    scale = load_truth(fresh_run / "truth.json").robots[0].truth.world_from_map.scale
    assert str(scale) in text
    (fresh_run / "truth.json").write_text(text.replace(str(scale), value))
    assert refused(capsys, "score", fresh_run).startswith(f"{fresh_run / 'truth.json'}: ")


def test_the_log_of_another_robot_is_refused_by_name(fresh_run, tmp_path, capsys):
    logs = [fresh_run / f"robot_{k}/log.npz" for k in range(2)]
    contents = [log.read_bytes() for log in logs]
    for log, content in zip(logs, reversed(contents), strict=True):
        log.write_bytes(content)
    line = refused(capsys, "convert", fresh_run, tmp_path / "tum", "--to", "tum")
    assert line == f"{logs[0]}: is the log of 'robot_1', not of 'robot_0'"


@pytest.mark.parametrize(
    ("file", "change"),
    [
        ("merge.json", lambda record: record.update(reference="nobody")),
        ("merge.json", lambda record: record["pairs"][0].update(source="nobody")),
        ("truth.json", lambda record: record.update(pairs=[])),
        ("truth.json", lambda record: record["robots"].pop()),
        ("truth.json", lambda record: record["robots"].append(record["robots"][0])),
    ],
)
def test_files_of_different_runs_are_refused_by_name(fresh_run, capsys, file, change):
    edit(fresh_run / file, change)
    assert refused(capsys, "score", fresh_run).startswith(f"{fresh_run / file}: ")


def test_maps_are_found_from_any_working_directory(merged_run, monkeypatch):
    monkeypatch.chdir(merged_run.parent)
    for folder in (merged_run, merged_run.relative_to(merged_run.parent)):
        assert run_folder.load_maps(folder).names == ("robot_0", "robot_1")
    monkeypatch.chdir(merged_run)
    assert run_folder.load_maps(Path()).names == ("robot_0", "robot_1")
