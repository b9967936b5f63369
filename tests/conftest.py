"""Settings of all tests, and one short simulated run that the tests of a worker share."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from mapquilt.cli.app import run

# No wall-clock deadlines on a shared machine, and the same draws on every run.
settings.register_profile("mapquilt", deadline=None, derandomize=True)
settings.load_profile("mapquilt")

TIMES = "timings.json"


def command(*arguments: object) -> int:
    """Run the command line in this process: its exit status."""
    return run([str(argument) for argument in arguments])


def hashes(folder: Path, *, but: tuple[str, ...] = (TIMES,)) -> dict[str, str]:
    """Every file below a folder by its hash, but for those named."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in but
    }


@pytest.fixture(scope="session")
def merged_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two robots in an office, simulated, merged and scored; not to be written to."""
    folder = tmp_path_factory.mktemp("runs") / "office"
    assert command("simulate", "office", "--robots", 2, "--duration", 12, "--seed", 3, "--out", folder) == 0
    assert command("merge", folder) in (0, 1)
    assert command("score", folder) == 0
    return folder


@pytest.fixture
def fresh_run(merged_run: Path, tmp_path: Path) -> Path:
    """A copy of that run, to be written to."""
    return Path(shutil.copytree(merged_run, tmp_path / "run"))


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
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
