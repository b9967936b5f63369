"""Executors: a dead worker loses no task, and a task that kills workers fails after three tries."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mapquilt.jobs.runner import MAX_TRIES, Runner, Workers, process_pool
from tests.conftest import hashes


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
    return Runner(Workers(processes), lambda: (process_pool(processes), processes))


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
    assert isinstance(error, RuntimeError)
    assert str(MAX_TRIES) in str(error)


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


@pytest.mark.parametrize("start", [None, lambda: (ThreadPoolExecutor(1), 1)])
def test_errors_come_with_their_task(start):
    with Runner(start=start) as runner:
        results = dict(runner.completed(fail, [1, 2]))
        assert {task: str(error) for task, error in results.items()} == {1: "no 1", 2: "no 2"}
        with pytest.raises(ValueError, match="no 1"):
            runner.run(fail, [1])


def test_zero_workers_are_refused():
    with pytest.raises(ValueError, match="workers is 0, must be at least 1"):
        Workers(0)


@pytest.fixture
def cluster(tmp_path):
    """A Dask scheduler and two workers, processes of their own on this machine."""
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    processes = [subprocess.Popen([*dask, "--no-dashboard", "--scheduler-file", str(file)], stderr=subprocess.DEVNULL)]
    while not file.exists():
        time.sleep(0.1)
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
    quiet = {"stderr": subprocess.DEVNULL, "cwd": tmp_path}
    processes += [subprocess.Popen([*worker, "--nthreads", "1", "--no-dashboard"], **quiet) for _ in range(2)]
    yield json.loads(file.read_text())["address"], processes
    for process in reversed(processes):
        process.terminate()
        process.wait(timeout=20)


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
