"""Run of the reproduction, which the same command resumes after an interruption."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mapping.io.shape import require_shape
from mapquilt.jobs.journal import JOURNAL_FILE, Entry, Journal, counting, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.jobs.timing import one_thread
from merge.pair.feature_cache import FeatureCache
from reproductions.chen2021.answers import Answer, answers_of
from reproductions.chen2021.cases import PLACES, SETS, Place, trials
from reproductions.chen2021.descriptors import Descriptors
from reproductions.chen2021.fusion import FusedIndex, fused_indices
from reproductions.chen2021.methods import GROUPS
from reproductions.chen2021.missions import Hall, floor_maps
from reproductions.chen2021.team import floor_answers, floor_pairs

SPEC_FILE = "thesis.json"
SPEC_TEXT = '{"schema": "mapquilt-thesis/5"}\n'
MOST_SEEDS = 1000


@dataclass(frozen=True)
class Task:
    """All maps of one place and seed, and the answers of all methods to them."""

    place: Place
    seed: int

    @property
    def name(self) -> str:
        return f"{self.place} {self.seed}"


@dataclass(frozen=True)
class Study:
    """Results by seed, the hall's before the floor's, in the order of trials, methods and runs."""

    seeds: int
    answers: tuple[Answer, ...] = ()
    descriptors: tuple[Descriptors, ...] = ()
    fused: tuple[FusedIndex, ...] = ()

    def record(self) -> dict[str, list[dict[str, Any]]]:
        """Return the results as JSON has them, without what is None."""
        parts = asdict(self)
        return {
            part: [{name: value for name, value in one.items() if value is not None} for one in parts[part]]
            for part in ("answers", "descriptors", "fused")
        }


def run_task(task: Task) -> Study:
    """Run a task; the result depends on it alone."""
    with one_thread():
        return _hall(task.seed) if task.place == "hall" else _floor(task.seed)


def _hall(seed: int) -> Study:
    hall, cache = Hall(seed), FeatureCache()
    answers: list[Answer] = []
    descriptors: list[Descriptors] = []
    fused: list[FusedIndex] = []
    for trial in trials():
        pair = hall.pair(trial.condition)
        descriptors.append(Descriptors.of(pair, trial.name, seed))
        answers += answers_of(pair, trial.name, GROUPS[trial.methods], seed, cache)
        if trial.name in {case.name for case in SETS}:
            fused += fused_indices(pair, hall.world, trial.name, seed)
    return Study(1, tuple(answers), tuple(descriptors), tuple(fused))


def _floor(seed: int) -> Study:
    maps = floor_maps(seed)
    described = [Descriptors.of(pair, case, seed) for case, pair in floor_pairs(maps).items()]
    return Study(1, tuple(floor_answers(maps, seed)), tuple(described))


def make_study(seeds: int, out: Path, runner: Runner, on_progress: Progress = no_progress) -> Study:
    """Run all seeds, from 0, but for those that the journal in the folder lists already.

    Raises ``ValueError`` if there are too few or too many seeds, the folder holds anything else, or another process
    works in it, and ``OSError`` if it cannot be written. What is finished stays.
    """
    if not 1 <= seeds <= MOST_SEEDS:
        raise ValueError(f"--seeds {seeds}: must lie between 1 and {MOST_SEEDS}")
    tasks = [Task(place, seed) for place in PLACES for seed in range(seeds)]
    journal = Journal[Task](out / JOURNAL_FILE, lambda task: task.name, _check_entry)
    with job_folder(out, "study of Chen (2021)", SPEC_FILE, SPEC_TEXT):
        entries = journal.run(runner, run_task, tasks, _keep, on_entries=counting(on_progress, len(tasks)))
        return _study(seeds, tuple(entries.values()))


def _keep(_: Task, done: Study | BaseException) -> Entry:
    if isinstance(done, BaseException):
        raise done
    return done.record()


def _check_entry(entry: Entry, place: str) -> None:
    answer = {"trial": str, "method": str, "seed": int, "run": int, "right": bool, "accepted": bool}
    require_shape(entry, {"answers": [answer], "descriptors": [dict], "fused": [dict]}, place)


def _study(seeds: int, entries: Sequence[Entry]) -> Study:
    return Study(
        seeds,
        tuple(Answer(**one) for entry in entries for one in entry["answers"]),
        tuple(Descriptors(**one) for entry in entries for one in entry["descriptors"]),
        tuple(FusedIndex(**one) for entry in entries for one in entry["fused"]),
    )
