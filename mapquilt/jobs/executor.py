"""Where the work is done: a pool of processes on this machine, or a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for
from threading import Thread
from typing import TypeVar

MOST_TRIES = 3
"""How often work is tried whose worker died."""

IN_FLIGHT = 2
"""Pieces of work handed out for each worker, so that none waits and memory stays bounded."""

Task = TypeVar("Task")
Result = TypeVar("Result")
MakeExecutor = Callable[[], Executor]


def process_pool(workers: int, preload: Sequence[str] = ()) -> Executor:
    """Processes of their own, started clean. They leave interrupts to their parent, and die with it.

    Where the system can fork, they share the pages of the modules named by ``preload``, loaded once in a process that
    does nothing else.
    """
    shared = preload and "forkserver" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver" if shared else "spawn")
    if shared:
        context.set_forkserver_preload(list(preload))
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker)


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)


def dask_cluster(address: str) -> Executor:
    """The workers of a Dask scheduler, such as tcp://head:8786.

    Raises ``ImportError`` that says what to install where Dask is missing, ``OSError`` where nobody answers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ImportError("--scheduler needs Dask: pip install 'mapquilt[cluster]'") from None
    # pure=False: Dask takes equal calls for one and would hand back the first one's result.
    executor: Executor = Client(address, timeout="10s").get_executor(pure=False)  # type: ignore[no-untyped-call]
    return executor


def run_all(
    make_executor: MakeExecutor, function: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Generator[tuple[Task, Result | BaseException]]:
    """Each task with its result, or with what it raised, as they come. At most a few results are held at a time.

    A worker that dies breaks a process pool for good: it is made anew and the work handed out again, three times at
    most; then the task comes with the error.
    """
    waiting = list(reversed(tasks))
    tries: dict[int, int] = {}
    executor = make_executor()
    running: dict[Future[Result], Task] = {}
    try:
        while waiting or running:
            while waiting and len(running) < IN_FLIGHT * workers:
                task = waiting.pop()
                running[executor.submit(function, task)] = task
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            broken = [future for future in done if isinstance(future.exception(), BrokenProcessPool)]
            for future in done:
                if future not in broken:
                    error = future.exception()
                    yield running.pop(future), future.result() if error is None else error
            if broken:
                executor.shutdown(wait=False)
                executor = make_executor()
                # Who broke the pool cannot be told: all that was handed out counts as tried.
                for task in running.values():
                    tries[id(task)] = tries.get(id(task), 0) + 1
                given_up = [task for task in running.values() if tries[id(task)] >= MOST_TRIES]
                waiting += [task for task in running.values() if tries[id(task)] < MOST_TRIES]
                running.clear()
                for task in given_up:
                    yield task, RuntimeError(f"the worker died, {MOST_TRIES} times")
    finally:
        for future in running:
            future.cancel()
        executor.shutdown(wait=False)
        if running or waiting:  # left early: by an interrupt, or because the results cannot be kept
            for worker in multiprocessing.active_children():
                worker.terminate()
