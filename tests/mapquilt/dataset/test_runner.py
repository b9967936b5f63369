"""Executors: a dead worker loses no task, and a task that kills workers fails after three tries."""

import errno
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Timer

import pytest

from mapquilt.jobs import runner as runner_module
from mapquilt.jobs.code_version import code_version
from mapquilt.jobs.runner import (
    MAX_TRIES,
    Pool,
    Runner,
    WorkerDeathError,
    Workers,
    _check_versions,
    call_with_same_code,
    dask_cluster,
    process_pool,
)
from tests.conftest import hashes
from tests.mapquilt.cli.test_app import refused


def square(number):
    return number * number


def die_once(path):
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"


def always_die(number):
    os.kill(os.getpid(), signal.SIGKILL)


def fail(number):
    raise ValueError(f"no {number}")


def pool(processes: int) -> Runner:
    return Runner(Workers(processes), lambda: Pool(process_pool(processes), lambda: processes))


@pytest.mark.parametrize("processes", [1, 2])
def test_results_come_in_the_order_of_their_tasks(processes):
    steps = []
    with Runner(Workers(processes)) as runner:
        results = runner.run(square, list(range(20)), lambda done, total: steps.append((done, total)))
        assert runner.run(square, [7]) == [49]
    assert results == [number * number for number in range(20)]
    assert steps == [(done, 20) for done in range(1, 21)]


def test_a_dead_worker_is_replaced_and_its_task_done(tmp_path):
    paths = [tmp_path / str(k) for k in range(2)]
    with pool(1) as runner:
        assert dict(runner.completed(die_once, paths)) == dict.fromkeys(paths, "alive")


def test_a_task_that_kills_its_worker_fails_after_three_tries():
    with pool(1) as runner:
        ((task, error),) = runner.completed(always_die, [7])
    assert task == 7
    assert isinstance(error, WorkerDeathError)


def die_if_seven(task):
    number, folder = task
    (folder / f"{number} {len(list(folder.iterdir()))}").touch()
    return always_die(number) if number == 7 else number


def test_no_task_is_blamed_for_another_that_kills_its_workers(tmp_path):
    """Tasks that were running when a worker died run alone, and each but the killer is done."""
    tasks = [(number, tmp_path) for number in range(5, 10)]
    with pool(2) as runner:
        results = {task[0]: result for task, result in runner.completed(die_if_seven, tasks)}
    assert isinstance(results.pop(7), WorkerDeathError)
    assert results == {number: number for number in (5, 6, 8, 9)}
    assert len(list(tmp_path.glob("7 *"))) == MAX_TRIES


def test_a_worker_that_dies_idle_is_replaced():
    with pool(1) as runner:
        assert runner.run(square, [3]) == [9]
        (worker,) = multiprocessing.active_children()
        worker.kill()
        worker.join()
        assert runner.run(square, [4]) == [16]


def fail_until(task):
    """Raise a fault of the machine in all but the last of some tries, which are counted by files."""
    folder, error, tries = task
    (folder / str(len(list(folder.iterdir())))).touch()
    if len(list(folder.iterdir())) < tries:
        raise error
    return "done"


@pytest.mark.parametrize("start", [None, lambda: Pool(ThreadPoolExecutor(1), lambda: 1)])
@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), MemoryError()])
def test_a_fault_of_the_machine_is_tried_again_at_most_three_times(tmp_path, start, error):
    for tries in (2, MAX_TRIES, MAX_TRIES + 1):
        folder = tmp_path / str(tries)
        folder.mkdir()
        with Runner(start=start) as runner:
            ((_, result),) = runner.completed(fail_until, [(folder, error, tries)])
        assert result == ("done" if tries <= MAX_TRIES else error)
        assert len(list(folder.iterdir())) == min(tries, MAX_TRIES)


def test_a_refusal_is_tried_once(tmp_path):
    with Runner() as runner:
        ((_, result),) = runner.completed(fail_until, [(tmp_path, ValueError("no"), 2)])
    assert str(result) == "no"
    assert len(list(tmp_path.iterdir())) == 1


PARENT = """
import os, time
from mapquilt.jobs.runner import process_pool
if __name__ == "__main__":
    pool = process_pool(1, {preload})
    print(pool.submit(os.getpid).result(), flush=True)
    pool.submit(time.sleep, 60)
    time.sleep(60)
"""


@pytest.mark.parametrize("preload", [(), ("json",)])
def test_workers_die_with_their_parent(preload, tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(PARENT.format(preload=preload))
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    worker = Path(f"/proc/{parent.stdout.readline().strip()}")
    assert worker.exists()
    parent.kill()
    parent.communicate()
    ended = time.monotonic() + 30.0
    while worker.exists() and "(zombie)" not in (worker / "status").read_text():
        assert time.monotonic() < ended
        time.sleep(0.05)


@pytest.mark.parametrize("start", [None, lambda: Pool(ThreadPoolExecutor(1), lambda: 1)])
def test_errors_come_with_their_task(start):
    with Runner(start=start) as runner:
        results = dict(runner.completed(fail, [1, 2]))
        assert {task: str(error) for task, error in results.items()} == {1: "no 1", 2: "no 2"}
        with pytest.raises(ValueError, match="no 1"):
            runner.run(fail, [1])


def test_zero_workers_are_refused():
    with pytest.raises(ValueError, match="workers is 0, must be at least 1"):
        Workers(0)


def test_a_cluster_makes_the_same_bytes_even_if_a_worker_is_killed(cluster, tiny, spec_file, tmp_path):
    address, processes = cluster
    arguments = ["dataset", "make", str(spec_file), "--out", str(tmp_path / "data"), "--scheduler", address]
    making = subprocess.Popen([sys.executable, "-m", "mapquilt", *arguments])
    while not (tmp_path / "data/.lock").exists():
        time.sleep(0.1)
    time.sleep(2.0)
    processes[1].kill()
    assert making.wait(timeout=120) == 0
    assert hashes(tmp_path / "data") == hashes(tiny)


def test_a_cluster_gets_as_many_tasks_as_it_has_threads(cluster):
    address, _ = cluster
    pool = dask_cluster(address)
    ended = time.monotonic() + 30.0
    while pool.capacity() < 2 and time.monotonic() < ended:
        time.sleep(0.1)
    assert pool.capacity() == 2
    pool.executor.shutdown()


class Answering:
    """A client whose workers state these versions."""

    def __init__(self, versions):
        self.versions = versions

    def run(self, function, on_error):
        assert on_error == "return"
        return self.versions


def test_workers_of_another_code_version_are_named():
    own = code_version()
    _check_versions("tcp://head:1", Answering({"tcp://a:1": own, "tcp://b:1": own, "tcp://c:1": OSError("died")}))
    with pytest.raises(OSError, match=r"worker tcp://b:1 is 0\.1\.0\+abc, but that of this machine"):
        _check_versions("tcp://head:1", Answering({"tcp://a:1": own, "tcp://b:1": "0.1.0+abc"}))
    with pytest.raises(OSError, match="worker tcp://a:1 is none that can be used"):
        _check_versions("tcp://head:1", Answering({"tcp://a:1": ModuleNotFoundError("No module named 'mapquilt'")}))


def test_a_scheduler_that_is_not_there_is_one_line(capsys, tmp_path, spec_file, monkeypatch):
    monkeypatch.setattr(runner_module, "WORKERS_TIMEOUT", 1.0)
    line = refused(capsys, "dataset", "make", spec_file, "--out", tmp_path / "data", "--scheduler", "tcp://127.0.0.1:9")
    assert "--scheduler tcp://127.0.0.1:9: no Dask scheduler answers there" in line


def test_a_scheduler_that_dies_ends_the_run_in_one_error(cluster):
    address, processes = cluster
    with Runner(Workers(1, address)) as runner:
        assert runner.run(square, [3]) == [9]
        Timer(1.0, processes[0].kill).start()
        with pytest.raises(OSError, match="is gone, with the tasks that it held"):
            runner.run(time.sleep, [60.0] * 4)
    for worker in processes[1:]:  # they wait for the scheduler to come back
        worker.kill()


def test_a_worker_of_another_code_that_joins_late_is_a_fault_of_the_machine():
    assert call_with_same_code(code_version(), square, 7) == 49
    with pytest.raises(OSError, match=r"the code of a worker on .* is .*, but the command's is 0\.1\.0\+abc"):
        call_with_same_code("0.1.0+abc", square, 7)


def test_a_cluster_that_lost_all_workers_ends_the_run_after_a_while(cluster, monkeypatch):
    monkeypatch.setattr(runner_module, "WITHOUT_WORKERS", 1.0)
    monkeypatch.setattr(runner_module, "WORKERS_TIMEOUT", 3.0)
    address, processes = cluster
    with Runner(Workers(1, address)) as runner:
        assert runner.run(square, [3]) == [9]
        for worker in processes[1:]:
            worker.terminate()
        with pytest.raises(OSError, match="has had no worker for 1 s; start some: dask worker tcp://"):
            runner.run(time.sleep, [60.0] * 4)


def test_a_scheduler_without_workers_says_how_to_start_one(monkeypatch, tmp_path):
    monkeypatch.setattr(runner_module, "WORKERS_TIMEOUT", 5.0)
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler = subprocess.Popen([*dask, "--no-dashboard", "--scheduler-file", str(file)], stderr=subprocess.DEVNULL)
    try:
        while not file.exists():
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        with pytest.raises(OSError, match=f"has no worker; start some: dask worker {address}"):
            dask_cluster(address)
    finally:
        scheduler.terminate()
        scheduler.wait(timeout=20)
