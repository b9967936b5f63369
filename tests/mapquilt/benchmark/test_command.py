"""mapquilt benchmark, from files to files."""

import csv
import json

import cv2
import numpy as np
import pytest

from mapquilt.benchmark import trials
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.trials import run_trial
from mapquilt.jobs.runner import Runner
from mapquilt.report.of_benchmark import benchmark_content
from tests.conftest import command, hashes

TIMED = ("timings.json", "table.md")


@pytest.fixture(scope="module")
def made(pairs_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("benchmark") / "out"
    arguments = ["benchmark", "--pairs", pairs_file, "--method", "orb", "--as-published", "--out"]
    assert command(*arguments, out) == 0
    return out, arguments


def test_every_answer_has_a_row(made):
    with (made[0] / "pairs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["pair"]) for row in rows] == [
        (method, pair) for method in ("orb", "orb as published") for pair in ("pair0", "pair1", "none")
    ]
    assert [row["outcome"] for row in rows] == ["true accept", "true accept", "true reject"] * 2
    assert [row["accepted"] for row in rows] == ["True", "True", "False"] * 2
    assert [row["negative"] for row in rows] == ["False", "False", "True"] * 2
    assert all(row["score"] for row in rows[:2])
    assert not any(row["score"] for row in rows[3:])
    assert all(float(row["rotation_deg"]) < 0.5 for row in rows if row["rotation_deg"])
    assert rows[2]["reason"]


def test_the_summary_agrees_with_the_rows(made):
    summary = json.loads((made[0] / "summary.json").read_text())
    found = {(row["group"], row["stratum"], row["method"]): row for row in summary["strata"]}
    assert summary["methods"] == ["orb", "orb as published"]
    assert found["positives", "all", "orb"]["right"]["count"] == 2
    assert found["subset", "part1", "orb as published"]["true_accepts"]["count"] == 1
    assert found["negatives", "all", "orb"]["false_accepts"]["count"] == 0
    assert found["negatives", "all", "orb"]["right"] is None
    assert [one["method"] for one in summary["calibration"]] == ["orb"]
    assert "seconds" not in json.dumps(summary)


def test_the_report_names_the_group_of_each_stratum(made):
    sheet, comparisons = benchmark_content(made[0]).sheets
    assert [row[1] for row in comparisons.rows] == ["orb not shown to differ from orb as published"] * 2
    names = [(row[0], row[1], row[2]) for row in sheet.rows]
    assert len(set(names)) == len(names)
    assert {"positives", "subset: part1", "negatives", "every pair"} <= {name for name, *_ in names}


def test_pictures_and_table_are_there(made):
    folder = made[0]
    for picture in ("reliability.png", "sheets/orb-01.png", "sheets/orb-as-published-01.png"):
        assert cv2.imread(str(folder / picture)) is not None, picture
    table = (folder / "table.md").read_text()
    assert "| all | orb | as published | 2 | 100.0 (34.2 to 100.0) |" in table
    assert "## Calibration" in table
    seconds = json.loads((folder / "timings.json").read_text())["pairs"]
    assert len(seconds) == 6
    assert all(entry["seconds"] > 0.0 for entry in seconds)


def test_the_same_call_gives_the_same_bytes_but_for_times_and_replaces_the_old(made, capsys):
    out, arguments = made
    before = hashes(out, but=TIMED)
    assert command(*arguments, out) == 0
    assert hashes(out, but=TIMED) == before
    printed = capsys.readouterr().out
    assert "published" in printed and "verified" in printed


def test_after_an_interruption_the_same_command_continues(made, pairs_file, tmp_path, monkeypatch):
    out, arguments = made
    answered = []

    def interrupted(task):
        if len(answered) == 1:
            raise KeyboardInterrupt
        answered.append(task.number)
        return run_trial(task)

    monkeypatch.setattr(trials, "run_trial", interrupted)
    assert command(*arguments, tmp_path / "out") == 130
    assert not (tmp_path / "out").exists()
    journal = tmp_path / ".out.unfinished/.journal.jsonl"
    assert [json.loads(line)["task"] for line in journal.read_text().splitlines()] == ["0"]
    monkeypatch.setattr(trials, "run_trial", lambda task: answered.append(task.number) or run_trial(task))
    assert command(*arguments, tmp_path / "out") == 0
    assert answered == [0, 1, 2]
    assert hashes(tmp_path / "out", but=TIMED) == hashes(out, but=TIMED)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_answer_is_read_by_its_number_as_in_turn(pairs_file, tmp_path):
    pairs, methods = read_pair_list(pairs_file), trials.chosen_methods(("orb",), None, as_published=False)
    with Runner() as runner:
        in_memory = trials.run_benchmark(pairs, methods, 0, runner)
        stored = trials.run_benchmark(pairs, methods, 0, runner, work=tmp_path / "work")
    shown = [(one.method, one.pair.name, one.answer, one.evidence) for one in stored]
    assert shown == [(one.method, one.pair.name, one.answer, one.evidence) for one in in_memory]
    assert [stored[number] for number in range(-6, 6)] == [*stored, *stored]
    with pytest.raises(IndexError):
        stored[len(stored)]


def test_plain_orb_also_runs_alone_since_its_time_is_the_unit():
    titles = [settings.title for settings in trials.chosen_methods(("quilt", "orb"), None, as_published=False)]
    assert titles == ["quilt", "orb", "orb as published"]


def test_the_number_of_threads_is_restored(made, pairs_file, tmp_path):
    before = cv2.getNumThreads()
    assert command("benchmark", "--pairs", pairs_file, "--method", "orb", "--limit", 1, "--out", tmp_path / "o") == 0
    assert cv2.getNumThreads() == before
    assert json.loads((tmp_path / "o/summary.json").read_text())["strata"][-1]["pairs"] == 1


@pytest.mark.slow
def test_two_workers_give_the_same_answers_as_one(made, pairs_file, tmp_path):
    out, arguments = made
    assert command(*arguments, tmp_path / "out", "--workers", 2, "--pictures", 0) == 0
    for name in ("pairs.csv", "summary.json"):
        assert (tmp_path / "out" / name).read_bytes() == (out / name).read_bytes()


def refused(capsys, *arguments):
    assert command("benchmark", *arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_bad_input_ends_in_one_line(capsys, pairs_file, tmp_path):
    out = ("--out", tmp_path / "out")
    assert "--pairs FILE or --dataset DIR" in refused(capsys, *out)
    assert "gone.json" in refused(capsys, "--pairs", tmp_path / "gone.json", *out)
    assert "nowhere" in refused(capsys, "--dataset", tmp_path / "nowhere", *out)
    assert "magic" in refused(capsys, "--pairs", pairs_file, "--method", "magic", *out)
    assert "named twice" in refused(capsys, "--pairs", pairs_file, "--method", "orb", "--method", "orb", *out)
    assert "--split test" in refused(capsys, "--pairs", pairs_file, "--split", "test", *out)
    assert "--limit 0" in refused(capsys, "--pairs", pairs_file, "--limit", 0, *out)
    assert "wide" in refused(capsys, "--pairs", pairs_file, "--scale", "wide", *out)
    assert list(tmp_path.iterdir()) == []


def test_an_image_that_is_not_a_map_is_named(capsys, pairs_file, tmp_path):
    for file in pairs_file.parent.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    cv2.imwrite(str(tmp_path / "1b.png"), np.full((80, 80), 205, np.uint8))
    line = refused(capsys, "--pairs", tmp_path / "pairs.json", "--method", "orb", "--out", tmp_path / "out")
    assert "1b.png" in line


def test_a_foreign_folder_is_never_replaced(capsys, pairs_file, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert str(tmp_path) in refused(capsys, "--pairs", pairs_file, "--method", "orb", "--out", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
