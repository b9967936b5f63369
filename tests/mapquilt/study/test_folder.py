"""A study from end to end: the same bytes when resumed and on any executor; content of its files."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import pytest
from distributed import LocalCluster

import mapquilt.study.folder as folder_module
from mapquilt.jobs.runner import Runner, Workers
from mapquilt.study.files import TRIALS_FILE, load_results
from mapquilt.study.folder import run_study
from tests.conftest import command, hashes
from tests.mapquilt.study.conftest import plan, run, thread

TIMES = ("timings.json", "timings.csv", TRIALS_FILE)


def test_the_files_agree_with_one_another(tiny_study):
    record = json.loads((tiny_study / "study.json").read_text())
    rows = list(csv.DictReader((tiny_study / "results.csv").open()))
    pairs = list(csv.DictReader((tiny_study / "pairs.csv").open()))
    assert [(row["sensing.noise"], row["method"]) for row in rows] == [(n, m) for n in "03" for m in ("quilt", "orb")]
    for row, cell in zip(rows, record["cells"], strict=True):
        here = [
            pair for pair in pairs if (pair["sensing.noise"], pair["method"]) == (row["sensing.noise"], row["method"])
        ]
        asked = [p for p in here if p["identifiable"] == "True" and float(p["true_overlap"]) >= 0.15]
        hits = sum(pair["outcome"] == "true accept" for pair in asked)
        assert int(row["pairs"]) == cell["pairs"]["asked"] == len(asked)
        assert int(row["true_accepts"]) == cell["pairs"]["true_accepts"]["count"] == hits
        assert len(asked) > 0
        assert float(row["iou_free"]) == cell["iou_free"]["value"] > 0.3
    assert all((tiny_study / pair["target_map"]).is_file() for pair in pairs)
    times = json.loads((tiny_study / "timings.json").read_text())
    assert len(times["cells"]) == 4 and all(0.0 < one["p10_s"] <= one["median_s"] for one in times["cells"])


def test_levels_differ_by_the_noise_alone(tiny_study):
    trials = load_results(tiny_study).pairs
    by_level = {level: [t for t in trials if (t.pair.noise, t.method) == (level, "quilt")] for level in (0.0, 3.0)}
    for exact, noisy in zip(by_level[0.0], by_level[3.0], strict=True):
        assert exact.pair.name == noisy.pair.name
        assert exact.truth.overlap == noisy.truth.overlap
        scales = [one.truth.target_from_source.scale for one in (exact, noisy)]
        assert scales[0] == pytest.approx(scales[1], rel=1e-9)
        assert exact.truth != noisy.truth


def test_a_journal_of_version_1_is_read(tiny_study, tmp_path):
    copy = Path(shutil.copytree(tiny_study, tmp_path / "copy"))
    entries = [json.loads(line) for line in (copy / TRIALS_FILE).read_text().splitlines()]
    old = [{"mission": int(entry.pop("task")), **entry} for entry in entries]
    (copy / TRIALS_FILE).write_text("".join(json.dumps(entry) + "\n" for entry in old))
    assert load_results(copy) == load_results(tiny_study)


def test_finished_missions_do_not_run_again(tiny_study, tmp_path, monkeypatch):
    copy = Path(shutil.copytree(tiny_study, tmp_path / "copy"))
    journal = copy / TRIALS_FILE
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(lines[0] + lines[1][: len(lines[1]) // 2])
    shutil.rmtree(copy / "maps" / "001")
    (copy / "study.json").unlink()
    done = []
    real = folder_module.run_mission
    monkeypatch.setattr(folder_module, "run_mission", lambda task: done.append(task.index) or real(task))
    run(plan("noise=0,3"), copy, tiny_study.parent / "missions")
    assert done == [1]
    assert hashes(copy, but=TIMES) == hashes(tiny_study, but=TIMES)


def test_a_cluster_gives_the_same_results(tiny_study, tmp_path):
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        Runner(Workers(scheduler=cluster.scheduler_address)) as runner,
    ):
        run_study(plan("noise=0,3"), tmp_path / "there", None, runner)
    assert hashes(tmp_path / "there", but=TIMES) == hashes(tiny_study, but=TIMES)


def test_a_mission_that_fails_is_reported_and_the_others_run(tmp_path):
    blind = plan("lidar.dropout=0,1", missions=1, methods=("orb",))
    with thread() as runner:
        found = run_study(blind, tmp_path / "lost", None, runner).results
    assert [failure.level for failure in found.failures] == [("1",)]
    assert {one.pair.level for one in found.pairs} == {("0",)}


def test_a_damaged_cache_gives_a_warning(tmp_path):
    wanted = plan("noise=0,1", missions=1, methods=("orb",))
    run(wanted, tmp_path / "first", tmp_path / "missions")
    (entry,) = (path for path in (tmp_path / "missions").iterdir() if path.is_dir())
    (entry / "robot_0.npz").write_bytes(b"")
    with thread() as runner:
        found = run_study(wanted, tmp_path / "second", tmp_path / "missions", runner)
    assert any("robot_0.npz has changed; simulated again" in warning for warning in found.warnings)
    assert hashes(tmp_path / "first", but=TIMES) == hashes(tmp_path / "second", but=TIMES)


def test_another_study_and_foreign_folders_are_refused(tiny_study, tmp_path):
    with pytest.raises(ValueError, match="holds a study of mapquilt with other settings"):
        run(plan("noise=0,2"), tiny_study)
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ValueError, match="not empty"):
        run(plan("noise=0,2"), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_command_prints_and_draws(tiny_study, tmp_path, capsys):
    copy = Path(shutil.copytree(tiny_study, tmp_path / "copy"))
    given = ["study", "--vary", "noise=0,3", "--set", "robots=2", "--set", "duration=4"]
    given += ["--set", "starts=close", "--method", "quilt"]
    given += ["--method", "orb", "--world", "house", "--missions", 2, "--seed", 3, "--workers", 1, "--out", copy]
    assert command(*given) == 0
    printed = capsys.readouterr().out
    assert "8 merges of 2 missions" in printed and "quilt" in printed
    for name in ("success", "errors", "quality", "time"):
        assert (copy / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert command("study", "noise", "--vary", "nose=1,2", "--out", tmp_path / "never") == 2
    assert "nose is no setting" in capsys.readouterr().err
    assert not (tmp_path / "never").exists()
