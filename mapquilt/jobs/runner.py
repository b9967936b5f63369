"""Run tasks in this process, on processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import socket
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for
from threading import Thread
from types import TracebackType
from typing import Any, Self, TypeVar

from mapquilt.jobs.code_version import code_version

MAX_TRIES = 3
"""Number of times a task is tried when the machine fails it: its worker dies, or memory or the disk is full."""

TASKS_PER_PROCESS = 2
"""Tasks handed out per local process: none waits, and memory stays bounded."""

WORKERS_TIMEOUT = 10.0
"""Longest wait for a scheduler to answer and to have a worker [s]."""

WITHOUT_WORKERS = 300.0
"""Longest wait for a cluster without workers to have one again [s]: a batch system starts a job in minutes."""

Task = TypeVar("Task")
Result = TypeVar("Result")
Progress = Callable[[int, int], None]
"""Called with the number of finished tasks and their total."""


class WorkerDeathError(OSError):
    """The workers of a task died each time it was tried; most often the system killed them for want of memory."""


class UnfinishedError(OSError):
    """The machine failed some tasks of a job, each several times; the same command tries them again."""


def no_progress(done: int, total: int) -> None:
    """Ignore progress."""


@dataclass(frozen=True)
class Pool:
    """Hold an executor and the number of tasks that it is given at a time, which may change; ``scheduler`` is the
    address of its cluster, None on this machine. A cluster without a worker has a capacity of 0."""

    executor: Executor
    capacity: Callable[[], int]
    scheduler: str | None = None


@dataclass(frozen=True)
class Workers:
    """Choose where tasks run.

    One process without a scheduler means this process. ``scheduler`` is the address of a Dask scheduler
    (``tcp://head:8786``), whose workers replace local processes. ``preload`` names modules that local processes share,
    loaded once, if the system can fork.

    Raises ``ValueError`` if ``processes`` is less than 1.
    """

    processes: int = 1
    scheduler: str | None = None
    preload: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.processes < 1:
            raise ValueError(f"workers is {self.processes}, must be at least 1")

    @property
    def local(self) -> bool:
        """True if tasks run in this process."""
        return self.processes == 1 and self.scheduler is None

    def start(self) -> Pool:
        """Start the executor. Raises as ``dask_cluster`` if there is a scheduler."""
        if self.scheduler is not None:
            return dask_cluster(self.scheduler)
        return Pool(process_pool(self.processes, self.preload), lambda: TASKS_PER_PROCESS * self.processes)


def process_pool(workers: int, preload: Sequence[str] = ()) -> Executor:
    """Start clean processes that ignore interrupts, which their parent handles, and that die with it."""
    shared = preload and "forkserver" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver" if shared else "spawn")
    if shared:
        context.set_forkserver_preload(list(preload))
    try:
        return ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker)
    except OSError as error:  # it names no file; the semaphores of a pool are files in /dev/shm
        raise OSError(
            f"--workers {workers}: no processes can be started ({error.strerror}: /dev/shm); --workers 1 needs none"
        ) from None


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)


def dask_cluster(address: str) -> Pool:
    """Connect to a Dask scheduler. As many tasks are handed out as its workers have threads at the time.

    Raises ``ImportError`` if Dask is missing, and ``OSError`` with the address if nobody answers, there is no worker,
    or a worker has another version of mapquilt.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ImportError("--scheduler needs Dask: pip install 'mapquilt[cluster]'") from None
    for name in ("distributed", "distributed.client"):  # each fault is told once, by the errors raised here
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=WORKERS_TIMEOUT)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise OSError(f"--scheduler {address}: no Dask scheduler answers there ({reason})") from None
    try:
        client.wait_for_workers(1, timeout=WORKERS_TIMEOUT)
        _check_versions(address, client)
    except TimeoutError:
        client.close()  # type: ignore[no-untyped-call]
        raise OSError(f"--scheduler {address}: has no worker; start some: {_start_worker_text(address)}") from None
    # pure=False: otherwise Dask takes equal calls for one and returns the first one's result.
    executor: Executor = client.get_executor(pure=False)  # type: ignore[no-untyped-call]

    def threads() -> int:
        try:
            return sum(client.nthreads().values())  # type: ignore[no-untyped-call]
        except OSError:
            raise _gone(address) from None

    return Pool(executor, threads, address)


def _start_worker_text(address: str | None) -> str:
    return f"dask worker {address} --nthreads 1 --nworkers auto"


def _gone(address: str | None) -> OSError:
    return OSError(f"--scheduler {address}: is gone, with the tasks that it held")


def _deserted(address: str | None) -> OSError:
    return OSError(
        f"--scheduler {address}: has had no worker for {WITHOUT_WORKERS:.0f} s; start some: "
        f"{_start_worker_text(address)}; then the same command continues"
    )


def _check_versions(address: str, client: Any) -> None:
    """Raise ``OSError`` naming the first worker whose code is not that of this process; dead ones do not count."""
    own = code_version()
    try:
        answers: dict[str, Any] = client.run(code_version, on_error="return")
    except OSError:
        raise _gone(address) from None
    for worker, found in sorted(answers.items()):
        if isinstance(found, Exception) and not isinstance(found, OSError):
            found = f"none that can be used ({found})"
        if isinstance(found, str) and found != own:
            raise OSError(
                f"--scheduler {address}: the code of worker {worker} is {found}, but that of this machine {own}; "
                "install the same"
            )


@contextmanager
def remote_runner(workers: Workers) -> Iterator[Runner | None]:
    """Start a runner; None if tasks run in this process, which some callers handle themselves."""
    if workers.local:
        yield None
        return
    with Runner(workers) as runner:
        yield runner


class Runner:
    """Run tasks on workers that start with the first task and stop at the end of the ``with`` block.

    ``start`` returns the pool to use; without it and with one local process, tasks run in this process.

    A fault of the machine, an ``OSError`` or ``MemoryError`` of a task or the death of its worker, is not a result: the
    task is tried again, at most ``MAX_TRIES`` times. A worker that dies breaks a process pool for good, and any of the
    running tasks may have killed it: the pool is started anew, and each of them runs alone, so that no task is blamed
    for another and memory is short for none.
    """

    def __init__(self, workers: Workers | None = None, start: Callable[[], Pool] | None = None) -> None:
        workers = workers or Workers()
        self._start = start or (None if workers.local else workers.start)
        self._pool: Pool | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is None:
            return
        self._pool.executor.shutdown(wait=False)
        if error is not None:  # interrupted, or the results cannot be kept: do not wait for running tasks
            for worker in multiprocessing.active_children():
                worker.terminate()

    def run(
        self, function: Callable[[Task], Result], tasks: Sequence[Task], on_progress: Progress = no_progress
    ) -> list[Result]:
        """Return the result of each task, in their order. Raise the first error of a task."""
        results: dict[int, Result] = {}
        for index, result in self._indexed(function, tasks):
            if isinstance(result, BaseException):
                raise result
            results[index] = result
            on_progress(len(results), len(tasks))
        return [results[index] for index in range(len(tasks))]

    def completed(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[Task, Result | BaseException]]:
        """Yield each task with its result or its error, in order of completion, holding few results at a time."""
        for index, result in self._indexed(function, tasks):
            yield tasks[index], result

    def _indexed(
        self, function: Callable[[Task], Result], tasks: Sequence[Task]
    ) -> Generator[tuple[int, Result | BaseException]]:
        if self._start is None:
            for index, task in enumerate(tasks):
                result = _outcome(function, task)
                for _ in range(MAX_TRIES - 1):
                    if isinstance(result, OSError | MemoryError):
                        result = _outcome(function, task)
                yield index, result
            return
        waiting = list(range(len(tasks) - 1, -1, -1))
        tries = [0] * len(tasks)
        running: dict[Future[Result], int] = {}
        seen_worker = time.monotonic()
        try:
            while waiting or running:
                if self._pool is None:
                    self._pool = self._start()
                capacity = self._pool.capacity()
                if capacity:
                    seen_worker = time.monotonic()
                elif time.monotonic() - seen_worker > WITHOUT_WORKERS:
                    raise _deserted(self._pool.scheduler)
                while waiting and len(running) < max(1, capacity):
                    if running and any(tries[index] for index in (waiting[-1], *running.values())):
                        break  # what was tried before runs alone
                    index = waiting.pop()
                    running[_submit(self._pool, function, tasks[index])] = index
                # Wake up without a result too: a cluster may have more workers now, or none.
                done, _ = wait(running, WORKERS_TIMEOUT, FIRST_COMPLETED)
                if any(future.cancelled() for future in done):
                    raise _gone(self._pool.scheduler)
                if any(isinstance(future.exception(), BrokenProcessPool) for future in done):
                    self._pool.executor.shutdown(wait=False)
                    self._pool = None
                    done |= running.keys()
                for future in done:
                    index = running.pop(future)
                    error = future.exception()
                    tries[index] += 1
                    if isinstance(error, OSError | MemoryError | BrokenProcessPool) and tries[index] < MAX_TRIES:
                        waiting.append(index)
                    else:
                        yield index, future.result() if error is None else _named(error)
        finally:
            for future in running:
                future.cancel()


def _submit(pool: Pool, function: Callable[[Task], Result], task: Task) -> Future[Result]:
    """Hand out a task. The future of a pool whose worker died idle is that of a pool whose worker died at work."""
    try:
        if pool.scheduler is not None:
            return pool.executor.submit(call_with_same_code, code_version(), function, task)
        return pool.executor.submit(function, task)
    except BrokenProcessPool as error:
        future: Future[Result] = Future()
        future.set_exception(error)
        return future


def call_with_same_code(version: str, function: Callable[[Task], Result], task: Task) -> Result:
    """Call a function on a worker. Raises ``OSError`` if the worker, which may have joined late, has other code."""
    if code_version() != version:
        raise OSError(
            f"the code of a worker on {socket.gethostname()} is {code_version()}, but the command's is {version}; "
            "install the same"
        )
    return function(task)


def _named(error: BaseException) -> BaseException:
    """Return the error of a task; the death of its worker, of which each kind of pool has an error of its own, as
    ``WorkerDeathError``."""
    if isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker":  # Dask's, tried often enough
        return WorkerDeathError("its worker died each time it was tried; memory may be short")
    return error


def _outcome(function: Callable[[Task], Result], task: Task) -> Result | BaseException:
    """Return the result of a task, or the error that it raised, as a worker would; interrupts pass through."""
    try:
        return function(task)
    except Exception as error:  # noqa: BLE001 - handed to the caller, as from a worker
        return error
