"""Run of the reproduction, which the same command resumes after an interruption."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mapping.io.atomic import write_bytes_atomically
from mapping.io.shape import require_shape
from mapquilt.jobs.journal import JOURNAL_FILE, Entry, Journal, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from reproductions.chen2021.answers import CaseAnswer, answers_of
from reproductions.chen2021.cases import PLACES, Place
from reproductions.chen2021.map_store import maps_bytes, read_maps
from reproductions.chen2021.methods import method_named, study_methods
from reproductions.chen2021.missions import drawn_maps

SPEC_FILE = "thesis.json"
SPEC_TEXT = '{"schema": "mapquilt-thesis/2"}\n'
MAPS_FOLDER = "maps"
MOST_SEEDS = 1000


@dataclass(frozen=True)
class StudySpec:
    """Number of ``seeds``, from 0, and the titles of the methods. Raises ``ValueError`` naming a bad value."""

    seeds: int = 20
    methods: tuple[str, ...] = tuple(each.title for each in study_methods())

    def __post_init__(self) -> None:
        if not 1 <= self.seeds <= MOST_SEEDS:
            raise ValueError(f"--seeds {self.seeds}: must lie between 1 and {MOST_SEEDS}")
        for title in self.methods:
            method_named(title)
            if self.methods.count(title) > 1:
                raise ValueError(f"--method {title}: is named twice")


@dataclass(frozen=True)
class Task:
    """Maps of one place and seed, stored in the file ``maps``, or the answers of ``method`` on them."""

    place: Place
    seed: int
    maps: Path
    method: str | None = None

    @property
    def name(self) -> str:
        return f"{self.place} {self.seed} {self.method or 'maps'}"


@dataclass(frozen=True)
class Done:
    """Result of a task: answers with their seconds, or the bytes of its maps."""

    answers: tuple[tuple[CaseAnswer, float], ...] = ()
    maps: bytes | None = None


@dataclass(frozen=True)
class Study:
    """All answers in the order of methods, places, seeds and cases, and their seconds."""

    spec: StudySpec
    answers: tuple[CaseAnswer, ...]
    seconds: tuple[float, ...]


def run_task(task: Task) -> Done:
    """Run a task; apart from the seconds, the result depends on the task and its maps alone."""
    if task.method is None:
        return Done(maps=maps_bytes(drawn_maps(task.place, task.seed)))
    maps = read_maps(task.maps)
    return Done(tuple(answers_of(task.place, maps, method_named(task.method), task.seed)))


def make_study(spec: StudySpec, out: Path, runner: Runner, on_progress: Progress = no_progress) -> Study:
    """Run the missions, then method after method, and skip what the journal in the folder lists already.

    The longest tasks run first, so that no worker idles at the end. A study that ran with fewer seeds or other methods
    continues with what is missing. Raises ``ValueError`` if the folder holds anything else or another process works in
    it, ``OSError`` if it cannot be written. What is finished stays.
    """
    places = [(place, seed) for seed in range(spec.seeds) for place in PLACES]
    missions = [Task(place, seed, maps_file(out, place, seed)) for place, seed in places]
    matches = [replace(task, method=method) for method in spec.methods for task in missions]
    total = len(missions) + len(matches)
    journal = Journal[Task](out / JOURNAL_FILE, lambda task: task.name, _check_entry)

    def run(tasks: Sequence[Task], others: Sequence[Task]) -> dict[str, Entry]:
        known = journal.entries()
        before = sum(task.name in known for task in others)
        entries = journal.run(
            runner,
            run_task,
            longest_first(tasks),
            _keep,
            lambda task, entry: _is_whole(out, entry),
            lambda entries: on_progress(before + len(entries), total),
        )
        return {entry["task"]: entry for entry in entries}

    with job_folder(out, "study of Chen (2021)", SPEC_FILE, SPEC_TEXT):
        (out / MAPS_FOLDER).mkdir(exist_ok=True)
        run(missions, matches)
        done = run(matches, missions)
    return _study(spec, [done[task.name] for task in matches])


LONGEST_PLACES: tuple[Place, ...] = ("floor", "hall")
LONGEST_METHODS = ("random_walk", "morphology", "genetic", "quilt", "icp", "sift")
"""The slowest methods, by processor time."""


def longest_first(tasks: Sequence[Task]) -> list[Task]:
    """Order tasks by expected time, the longest first; results do not depend on the order."""

    def rank(task: Task) -> tuple[int, int]:
        method = "" if task.method is None else task.method
        slow = LONGEST_METHODS.index(method) if method in LONGEST_METHODS else len(LONGEST_METHODS)
        return slow, LONGEST_PLACES.index(task.place)

    return sorted(tasks, key=rank)


def maps_file(out: Path, place: Place, seed: int) -> Path:
    return out / MAPS_FOLDER / f"{place}-{seed:03d}.npz"


def _keep(task: Task, done: Done | BaseException) -> Entry:
    if isinstance(done, BaseException):
        raise done
    if done.maps is not None:
        write_bytes_atomically(task.maps, done.maps)
        return {"file": task.maps.name, "sha256": hashlib.sha256(done.maps).hexdigest()}
    return {
        "answers": [answer.record() for answer, _ in done.answers],
        "seconds": [seconds for _, seconds in done.answers],
    }


def _is_whole(out: Path, entry: Entry) -> bool:
    if "file" not in entry:
        return True
    path = out / MAPS_FOLDER / entry["file"]
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == str(entry["sha256"])


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"answers?": [{"pair": dict}], "seconds?": [float]}, place)


def _study(spec: StudySpec, entries: list[Entry]) -> Study:
    answers = [CaseAnswer.from_record(record) for entry in entries for record in entry["answers"]]
    return Study(spec, tuple(answers), tuple(seconds for entry in entries for seconds in entry["seconds"]))
