"""Making the study: whatever stops it, the same command goes on from there, and the answers are the same."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_aside
from mapquilt.jobs.executor import process_pool, run_all
from mapquilt.jobs.journal import LOCK_FILE, Journal, locked
from reproductions.chen2021.answers import StudyAnswer, answers_of
from reproductions.chen2021.cases import PLACES, Place
from reproductions.chen2021.map_store import maps_bytes, read_maps
from reproductions.chen2021.methods import method_named, study_methods
from reproductions.chen2021.missions import drawn_maps

SPEC_FILE = "thesis.json"
SPEC_TEXT = '{"schema": "mapquilt-thesis/1"}\n'
MAPS_FOLDER = "maps"
MOST_SEEDS = 1000

Progress = Callable[[int, int], None]
"""Called with how many pieces of work are done, of how many."""


@dataclass(frozen=True)
class StudySpec:
    """``seeds`` from 0 on, and the methods by title. Raises ``ValueError`` naming what does not fit."""

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
    """The maps of one place and seed, or where a method is named, its answers on them; ``maps`` is their file."""

    place: Place
    seed: int
    maps: Path
    method: str | None = None

    @property
    def name(self) -> str:
        return f"{self.place} {self.seed} {self.method or 'maps'}"


@dataclass(frozen=True)
class Done:
    """What came of a task: answers with their seconds, or the bytes of its maps."""

    answers: tuple[tuple[StudyAnswer, float], ...] = ()
    maps: bytes | None = None


@dataclass(frozen=True)
class Study:
    """All answers in the order of methods, places, seeds and cases, and their seconds."""

    spec: StudySpec
    answers: tuple[StudyAnswer, ...]
    seconds: tuple[float, ...]


def run_task(task: Task) -> Done:
    """A function of the task and its maps alone, but for the seconds."""
    if task.method is None:
        return Done(maps=maps_bytes(drawn_maps(task.place, task.seed)))
    maps = read_maps(task.maps)
    return Done(tuple(answers_of(task.place, maps, method_named(task.method), task.seed)))


def make_study(spec: StudySpec, out: Path, workers: int, on_progress: Progress = lambda done, total: None) -> Study:
    """Run what a journal in the folder does not know yet: missions first, then method after method, the longest work
    first, so that no worker is left without while another still has much.

    A study that was run with fewer seeds or other methods goes on with what is missing. Raises ``ValueError`` where
    the folder holds anything else or another process is at work, ``OSError`` where it cannot be written. What was
    finished stays.
    """
    _claim(out)
    places = [(place, seed) for seed in range(spec.seeds) for place in PLACES]
    missions = [Task(place, seed, maps_file(out, place, seed)) for place, seed in places]
    matches = [replace(task, method=method) for method in spec.methods for task in missions]
    total = len(missions) + len(matches)
    with locked(out):
        (out / MAPS_FOLDER).mkdir(exist_ok=True)
        journal = Journal(out)
        done = {entry["task"]: entry for entry in journal.entries() if _is_whole(out, entry)}

        def tell() -> None:
            on_progress(sum(task.name in done for task in missions + matches), total)

        tell()
        for stage in (missions, matches):
            waiting = [task for task in longest_first(stage) if task.name not in done]
            for task, result in _results(waiting, workers):
                done[task.name] = _keep(journal, task, result)
                tell()
    return _study(spec, [done[task.name] for task in matches])


LONGEST_PLACES: tuple[Place, ...] = ("floor", "hall")
LONGEST_METHODS = ("random_walk", "morphology", "genetic", "quilt", "icp", "sift")
"""By the processor time that they take; the others take less."""


def longest_first(tasks: Sequence[Task]) -> list[Task]:
    """The order in which tasks are handed out; their results do not depend on it."""

    def rank(task: Task) -> tuple[int, int]:
        method = "" if task.method is None else task.method
        slow = LONGEST_METHODS.index(method) if method in LONGEST_METHODS else len(LONGEST_METHODS)
        return slow, LONGEST_PLACES.index(task.place)

    return sorted(tasks, key=rank)


def maps_file(out: Path, place: Place, seed: int) -> Path:
    return out / MAPS_FOLDER / f"{place}-{seed:03d}.npz"


def _claim(out: Path) -> None:
    path = out / SPEC_FILE
    if path.exists():
        if path.read_text(encoding="utf-8") != SPEC_TEXT:
            raise ValueError(f"{path}: is not of a thesis study of this version; name another folder")
        return
    if out.exists() and (not out.is_dir() or any(child.name != LOCK_FILE for child in out.iterdir())):
        raise ValueError(f"{out}: is not empty and no thesis study of mapquilt; refusing to write into it")
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_aside(path, SPEC_TEXT.encode())


def _results(tasks: list[Task], workers: int) -> Iterator[tuple[Task, Done]]:
    if workers == 1 or len(tasks) < 2:
        yield from ((task, run_task(task)) for task in tasks)
        return
    with closing(run_all(partial(process_pool, workers), run_task, tasks, workers)) as results:
        for task, done in results:
            if isinstance(done, BaseException):
                raise done
            yield task, done


def _keep(journal: Journal, task: Task, done: Done) -> dict[str, Any]:
    entry: dict[str, Any] = {"task": task.name}
    if done.maps is not None:
        write_bytes_aside(task.maps, done.maps)
        entry |= {"file": task.maps.name, "sha256": hashlib.sha256(done.maps).hexdigest()}
    else:
        entry["answers"] = [answer.record() for answer, _ in done.answers]
        entry["seconds"] = [seconds for _, seconds in done.answers]
    journal.add(entry)
    return entry


def _is_whole(out: Path, entry: dict[str, Any]) -> bool:
    if "file" not in entry:
        return True
    path = out / MAPS_FOLDER / entry["file"]
    return path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == str(entry["sha256"])


def _study(spec: StudySpec, entries: list[dict[str, Any]]) -> Study:
    answers = [StudyAnswer.from_record(record) for entry in entries for record in entry["answers"]]
    return Study(spec, tuple(answers), tuple(seconds for entry in entries for seconds in entry["seconds"]))
