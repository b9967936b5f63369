"""Answers of pairs on disk while a merge runs, so that the same merge continues after an interruption."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from mapping.io.safe_load import reading
from mapping.io.shape import require_shape
from mapquilt.jobs.code_version import code_version
from mapquilt.jobs.journal import JOURNAL_FILE, TASKS_FILE, Entry, Journal, job_folder, remove_job, unfinished_folder
from mapquilt.jobs.runner import Runner
from mapquilt.merging.merge_file import pair_record, read_pair
from mapquilt.merging.merge_inputs import map_fingerprint
from merge.pair.pipeline import GuidedTask, match, match_near
from merge.pair.task import PairTask
from merge.records.result import PairResult

Call = tuple[Callable[..., Any], Any]
"""A function of the merger, and its task."""


@contextmanager
def recording(folder: Path, runner: Runner) -> Iterator[RecordingRunner]:
    """Keep the answers of a merge beside its ``folder`` until the block ends without an error.

    If it ends before the first answer, nothing is kept.

    Raises ``ValueError`` if another process merges into the folder.
    """
    work = unfinished_folder(folder)
    held, done = False, False
    try:
        with job_folder(work, "merge of mapquilt", TASKS_FILE, "answers of pairs\n"):
            held = True
            yield RecordingRunner(runner, work / JOURNAL_FILE)
        done = True
    finally:
        if done or (held and not (work / JOURNAL_FILE).exists()):
            remove_job(work, TASKS_FILE)


@dataclass(frozen=True, eq=False)
class _Match:
    """A call that matches a pair, under a ``name`` that is a hash of all that its answer depends on."""

    name: str
    function: Callable[[Any], PairResult]
    call: Call


class RecordingRunner:
    """Run the tasks of a merge, but a pair whose answer is on disk is not matched again.

    Answers are found by the maps, the settings and the code that they depend on. So a merge with other maps or settings
    uses what it has in common with the interrupted one, and nothing else.
    """

    def __init__(self, runner: Runner, journal: Path) -> None:
        self._runner = runner
        self._journal = Journal[_Match](journal, lambda match: match.name, _check_entry)

    def run(
        self, function: Callable[[Any], Any], tasks: Sequence[Any], on_progress: Callable[[int, int], None]
    ) -> list[Any]:
        """Return the result of each task, in their order."""
        if not all(called in (match, match_near) for called, _ in tasks):
            return self._runner.run(function, tasks, on_progress)
        matches = [_Match(_name(*call), function, call) for call in tasks]
        done = 0

        def count(entries: Mapping[str, Entry]) -> None:
            nonlocal done
            for _ in entries:
                done += 1
                on_progress(done, len(tasks))

        entries = self._journal.run(self._runner, _run, matches, _entry, on_entries=count)
        return [read_pair(entries[each.name]["pair"]) for each in matches]


def _run(task: _Match) -> PairResult:
    return task.function(task.call)


def _name(function: Callable[..., Any], task: PairTask | GuidedTask) -> str:
    pair = task.pair if isinstance(task, GuidedTask) else task
    near = (task.guess, task.candidates) if isinstance(task, GuidedTask) else ()
    parts = (
        code_version(),
        function.__name__,
        pair.names,
        tuple(map(map_fingerprint, pair.grids)),
        pair.units,
        pair.scale,
        pair.settings,
        pair.seed,
        near,
    )
    return sha256(repr(parts).encode()).hexdigest()


def _entry(_: _Match, result: PairResult | BaseException) -> Entry:
    if isinstance(result, BaseException):
        raise result
    return {"pair": pair_record(result)}


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"pair": dict}, place)
    with reading(place):
        read_pair(entry["pair"])
