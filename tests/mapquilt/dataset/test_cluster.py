"""Every verb that takes hours, on a Dask cluster of real processes: what dies or fills up loses nothing."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.conftest import command, hashes
from tests.processes import last_line, started, wait_for_entry

TIMED = ("timings.json", "timings.csv", "time.png", ".trials.jsonl", "table.md", ".lock", "reliability.png")
STUDY = ("study", "--vary", "noise=0,1", "--set", "robots=2", "--set", "duration=4", "--method", "orb")


@pytest.mark.slow
def test_a_benchmark_whose_worker_is_killed_gives_the_bytes_of_one_process(cluster, tiny, tmp_path):
    address, processes = cluster
    arguments = ("benchmark", "--dataset", tiny, "--method", "orb", "--pictures", 0, "--out")
    assert command(*arguments, tmp_path / "alone") == 0
    running = started(*arguments, tmp_path / "out", "--scheduler", address)
    wait_for_entry(tmp_path / ".out.unfinished/.journal.jsonl", running)
    processes[1].kill()
    _, told = running.communicate(timeout=120)
    assert running.returncode == 0, told
    assert hashes(tmp_path / "out", but=TIMED) == hashes(tmp_path / "alone", but=TIMED)


@pytest.mark.slow
def test_a_study_whose_worker_is_killed_gives_the_bytes_of_one_process(cluster, tmp_path):
    address, processes = cluster
    assert command(*STUDY, "--missions", 3, "--out", tmp_path / "alone", "--workers", 1) == 0
    running = started(*STUDY, "--missions", 3, "--out", tmp_path / "out", "--scheduler", address)
    wait_for_entry(tmp_path / "out/.trials.jsonl", running)
    processes[1].kill()
    _, told = running.communicate(timeout=120)
    assert running.returncode == 0, told
    assert hashes(tmp_path / "out", but=TIMED) == hashes(tmp_path / "alone", but=TIMED)


@pytest.mark.slow
def test_a_merge_of_a_data_set_whose_scheduler_is_killed_continues(cluster, tiny, tmp_path):
    address, processes = cluster
    alone, data = (Path(shutil.copytree(tiny, tmp_path / name)) for name in ("alone", "data"))
    status = command("merge", alone, "--workers", 1)
    assert status in (0, 1)
    running = started("merge", data, "--scheduler", address)
    wait_for_entry(data / ".merge/.journal.jsonl", running)
    processes[0].kill()
    assert f"--scheduler {address}: is gone" in last_line(running)
    assert running.returncode == 2
    for worker in processes[1:]:  # they wait for the scheduler to come back
        worker.kill()
    finished = set(data.glob("samples/*/merge.json"))
    times = {path: path.stat().st_mtime_ns for path in finished}
    entries = (data / ".merge/.journal.jsonl").read_text().count("\n")
    assert entries > 0
    assert command("merge", data, "--workers", 1) == status
    assert sum(path.stat().st_mtime_ns == times[path] for path in finished) >= entries
    assert hashes(data) == hashes(alone)


@pytest.mark.slow
def test_a_benchmark_on_a_full_disk_says_so_and_continues(tiny, tmp_path):
    arguments = ("benchmark", "--dataset", tiny, "--method", "orb", "--pictures", 0, "--out")
    running = started(*arguments, tmp_path / "out", file_bytes=20_000)
    assert ".journal.jsonl: File too large" in last_line(running)
    assert running.returncode == 2
    assert (tmp_path / ".out.unfinished/.journal.jsonl").read_text().count("\n") > 0
    assert not (tmp_path / "out").exists()
    for name in ("out", "alone"):
        assert command(*arguments, tmp_path / name) == 0
    assert hashes(tmp_path / "out", but=TIMED) == hashes(tmp_path / "alone", but=TIMED)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alone", "out"]
