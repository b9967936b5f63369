"""Folder of a study, which the same call resumes after an interruption."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mapping.io.atomic import write_bytes_atomically
from mapping.io.transaction import atomic_folder, refuse_links, write_files_atomically
from mapquilt.jobs.journal import Entry, counting, job_folder
from mapquilt.jobs.runner import Progress, Runner, no_progress
from mapquilt.json_file import check_record, to_text
from mapquilt.study.files import PLAN_FILE, load_results, table_files, trials_journal, trials_record
from mapquilt.study.plan import MissionTask, StudyPlan
from mapquilt.study.records import MAPS_FOLDER, Failure, MissionTrials
from mapquilt.study.results import StudyResults
from mapquilt.study.trial import run_mission

PLAN_SCHEMA = "mapquilt-plan/1"


@dataclass(frozen=True)
class StudyRun:
    """Results, and warnings, one line each."""

    results: StudyResults
    warnings: tuple[str, ...]


def run_study(
    plan: StudyPlan, out: Path, cache: Path | None, runner: Runner, on_progress: Progress = no_progress
) -> StudyRun:
    """Run a study in a folder, or continue one that was begun; finished missions are only counted again.

    The maps of a mission appear whole, and a synced journal lists the finished missions. Raises ``ValueError`` if the
    folder holds anything else, another study, or another process works in it, ``OSError`` if it cannot be written.
    """
    tasks = plan.tasks(cache)
    warnings: list[str] = []

    def keep(task: MissionTask, result: MissionTrials | BaseException) -> Entry:
        trials = _kept(out, task, result)
        warnings.extend(trials.warnings)
        return trials_record(trials)

    with job_folder(out, "study of mapquilt", PLAN_FILE, to_text(_plan_record(plan))):
        trials_journal(out).run(runner, run_mission, tasks, keep, on_entries=counting(on_progress, len(tasks)))
        found = load_results(out)
        write_files_atomically(table_files(out, found))
    return StudyRun(found, tuple(warnings))


def _plan_record(plan: StudyPlan) -> dict[str, Any]:
    record = {"schema": PLAN_SCHEMA, **plan.record()}
    check_record(Path(PLAN_FILE), "plan", record)
    return record


def _kept(out: Path, task: MissionTask, result: MissionTrials | BaseException) -> MissionTrials:
    if isinstance(result, BaseException):
        return MissionTrials(failures=[Failure(task.name, None, str(result))])
    refuse_links(out, out / MAPS_FOLDER / task.name)
    with atomic_folder(out / MAPS_FOLDER / task.name) as aside:
        for path, data in result.files.items():
            file = aside / Path(path).relative_to(task.name)
            file.parent.mkdir(exist_ok=True)
            write_bytes_atomically(file, data)
    return result
