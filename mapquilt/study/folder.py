"""The folder of a study: nothing is lost, whatever stops it, and the same call goes on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.atomic import folder_aside, write_bytes_aside, write_files_aside
from mapping.io.safe_load import read_json
from mapquilt.jobs.executor import MakeExecutor, run_all
from mapquilt.jobs.journal import LOCK_FILE, Journal, locked
from mapquilt.json_file import check_record, to_text
from mapquilt.runs.folder import refuse_foreign
from mapquilt.study.files import table_files
from mapquilt.study.plan import MissionTask, StudyPlan
from mapquilt.study.record import plan_from_record, trials_from_record, trials_record
from mapquilt.study.results import StudyResults, build_results
from mapquilt.study.trial import Failure, MissionTrials, run_mission

PLAN_FILE, TRIALS_FILE, MAPS_FOLDER = "plan.json", ".trials.jsonl", "maps"
PLAN_SCHEMA = "mapquilt-plan/1"

Progress = Callable[[int, int], None]
"""Called with how many missions are done, of how many."""


@dataclass(frozen=True)
class StudyRun:
    """The results, and what was odd in making them, one line each."""

    results: StudyResults
    warnings: tuple[str, ...]


def run_study(
    plan: StudyPlan,
    out: Path,
    cache: Path | None,
    make_executor: MakeExecutor,
    workers: int,
    on_progress: Progress = lambda done, total: None,
) -> StudyRun:
    """Run a study in a folder, or go on with one that was begun; what is finished already is only counted again.

    Each mission's maps appear whole, and a synced journal says which missions are done. Raises ``ValueError`` where
    the folder holds anything else, another study, or another process at work, ``OSError`` where it cannot be written.
    """
    _claim(out, plan)
    tasks = plan.tasks(cache)
    warnings: list[str] = []
    with locked(out):
        for leftover in (*out.glob(".*.part"), *(out / MAPS_FOLDER).glob(".*.part")):
            shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
        journal = Journal(out, TRIALS_FILE)
        done = {int(entry["mission"]) for entry in journal.entries()}
        on_progress(len(done), len(tasks))
        missing = [task for task in tasks if task.index not in done]
        with closing(run_all(make_executor, run_mission, missing, workers)) as results:
            for task, result in results:
                trials = _kept(out, task, result)
                warnings += trials.warnings
                journal.add(trials_record(task.index, trials))
                done.add(task.index)
                on_progress(len(done), len(tasks))
        found = load_results(out)
        write_files_aside(table_files(out, found))
    return StudyRun(found, tuple(warnings))


def _claim(out: Path, plan: StudyPlan) -> None:
    text = to_text(_plan_record(plan))
    path = out / PLAN_FILE
    if path.exists():
        if path.read_text(encoding="utf-8") != text:
            raise ValueError(f"{out}: holds a study of other settings; name another folder")
        return
    if out.is_dir() and {child.name for child in out.iterdir()} <= {LOCK_FILE}:
        (out / LOCK_FILE).unlink(missing_ok=True)
    refuse_foreign(out, PLAN_FILE)
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_aside(path, text.encode())


def _plan_record(plan: StudyPlan) -> dict[str, Any]:
    record = {"schema": PLAN_SCHEMA, **plan.record()}
    check_record(Path(PLAN_FILE), "plan", record)
    return record


def _kept(out: Path, task: MissionTask, result: MissionTrials | BaseException) -> MissionTrials:
    if isinstance(result, OSError | MemoryError | ImportError):
        raise result  # the machine's fault, not the mission's: to be tried again
    if isinstance(result, BaseException):
        return MissionTrials(failures=[Failure(task.name, None, f"{type(result).__name__}: {result}")])
    with folder_aside(out / MAPS_FOLDER / task.name) as aside:
        for path, data in result.files.items():
            file = aside / Path(path).relative_to(task.name)
            file.parent.mkdir(exist_ok=True)
            write_bytes_aside(file, data)
    return result


def is_study(folder: Path) -> bool:
    """Whether mapquilt began a study here."""
    return (folder / PLAN_FILE).is_file()


def load_results(folder: Path) -> StudyResults:
    """What the folder's study has found so far. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    path = folder / PLAN_FILE
    record = read_json(path)
    check_record(path, "plan", record)
    plan = plan_from_record(record)
    entries = sorted(Journal(folder, TRIALS_FILE).entries(), key=lambda entry: int(entry["mission"]))
    try:
        missions = [trials_from_record(entry) for entry in entries]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{folder / TRIALS_FILE}: is damaged: {json.dumps(str(error))}") from None
    return build_results(
        plan,
        [pair for trials in missions for pair in trials.pairs],
        [team for trials in missions for team in trials.teams],
        [failure for trials in missions for failure in trials.failures],
    )
