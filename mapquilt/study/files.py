"""Files of a study: its plan and trials as JSON, tables as CSV and JSON, times apart."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mapping.io.safe_load import read_json, reading
from mapping.io.shape import Shape, require_shape
from mapquilt.evaluation.pair_rows import COLUMNS, TRANSFORM, csv_text, from_row, to_row
from mapquilt.evaluation.statistics import Interval, Quantiles, Share
from mapquilt.jobs.journal import Entry, Journal
from mapquilt.json_file import check_record, record_bytes, to_text
from mapquilt.study.paired import PairedTest
from mapquilt.study.plan import Method, MissionTask, StudyPlan, plan_study
from mapquilt.study.records import MAPS_FOLDER, Failure, MissionTrials, TeamTrial
from mapquilt.study.results import Cell, Mean, StudyResults, build_results
from merge.settings import PUBLISHED

SCHEMA = "mapquilt-study/3"
PLAN_FILE, TRIALS_FILE = "plan.json", ".trials.jsonl"
STUDY_FILE, RESULTS_FILE, PAIRS_FILE, TESTS_FILE = "study.json", "results.csv", "pairs.csv", "tests.csv"
TIMINGS_FILE, TIMES_FILE = "timings.json", "timings.csv"
ERRORS = ("rotation_deg", "scale_percent", "displacement_m", "displacement_of_diagonal")
MEANS = ("iou_free", "f1_walls", "joined")
TEAM: Shape = {
    **{"mission": str, "world": str, "level": [str], "method": str, "maps": int, "joined": int, "pairs": int},
    **{"iou_free": float, "f1_walls": float, "seconds": float},
}
FAILURE: Shape = {"mission": str, "level": list | None, "reason": str}


def plan_from_record(record: dict[str, Any]) -> StudyPlan:
    """Read the plan of ``StudyPlan.record``. Raises ``ValueError`` naming a setting that is unknown by now."""
    vary = [f"{one['name']}={','.join(one['values'])}" for one in record["varied"]]
    fixed = [f"{name}={value}" for name, value in record["fixed"].items()]
    methods = [Method(title.removesuffix(PUBLISHED), title.endswith(PUBLISHED)) for title in record["methods"]]
    return plan_study(
        None, vary, fixed, methods, record["worlds"], record["missions"], record["seed"], record["min_overlap"]
    )


def trials_record(trials: MissionTrials) -> dict[str, Any]:
    """Build the journal entry of one mission; its maps are files of their own."""
    return {
        "pairs": [to_row(one) for one in trials.pairs],
        "teams": [dataclasses.asdict(one) for one in trials.teams],
        "failures": [dataclasses.asdict(one) for one in trials.failures],
    }


def trials_from_record(record: dict[str, Any]) -> MissionTrials:
    """Read a journal entry, of this version or the one before."""
    rows = [_renewed_row(row) if "bent" in row else row for row in record["pairs"]]
    return MissionTrials(
        pairs=[from_row(row) for row in rows],
        teams=[TeamTrial(**one | {"level": tuple(one["level"])}) for one in record["teams"]],
        failures=[Failure(**one | {"level": one["level"] and tuple(one["level"])}) for one in record["failures"]],
    )


def _renewed_row(old: Mapping[str, Any]) -> dict[str, Any]:
    """Convert a row of version 1, which held transforms as lists and the folder of both maps."""
    row = {
        name: value for name, value in old.items() if name not in ("answer", "truth", "runner_up", "overlap", "maps")
    }
    for name, prefix in (("answer", ""), ("truth", "true_"), ("runner_up", "runner_up_")):
        place = old[name] or (None,) * len(TRANSFORM)
        row |= {f"{prefix}{part}": value for part, value in zip(TRANSFORM, place, strict=True)}
    return row | {
        "pair": f"{old['mission']}: {old['target']} and {old['source']}",
        "true_overlap": old["overlap"],
        "negative": old["overlap"] == 0.0,
        "target_map": f"{MAPS_FOLDER}/{old['maps']}/{old['target']}.yaml",
        "source_map": f"{MAPS_FOLDER}/{old['maps']}/{old['source']}.yaml",
    }


def table_files(folder: Path, results: StudyResults) -> dict[Path, bytes]:
    """Build all tables and records; times are in the last two alone."""
    names = [one.variable.name for one in results.plan.varied]
    times = [dataclasses.asdict(time) for time in results.times]
    pair_columns = (*names, *(name for name in COLUMNS if name not in ("level", *names)))
    pair_rows = [{**to_row(one), **_level(names, one.pair.level)} for one in results.pairs]
    return {
        folder / RESULTS_FILE: _csv([_cell_row(names, cell) for cell in results.cells]),
        folder / PAIRS_FILE: csv_text(
            ({name: row[name] for name in pair_columns} for row in pair_rows), pair_columns
        ).encode(),
        folder / TESTS_FILE: _csv([_test_row(test) for test in results.tests]),
        folder / STUDY_FILE: record_bytes(folder / STUDY_FILE, "study", study_record(results)),
        folder / TIMINGS_FILE: to_text({"unit": "s", "threads": 1, "cells": times}).encode(),
        folder / TIMES_FILE: _csv([_level(names, time["level"]) | _without_level(time) for time in times]),
    }


def study_record(results: StudyResults) -> dict[str, Any]:
    """Build the content of study.json; no times."""
    return {
        "schema": SCHEMA,
        **results.plan.record(),
        "cells": [_with_lists(dataclasses.asdict(cell)) for cell in results.cells],
        "tests": [_with_lists(dataclasses.asdict(test)) | {"verdict": test.verdict} for test in results.tests],
        "failures": [_with_lists(dataclasses.asdict(failure)) for failure in results.failures],
    }


def _with_lists(record: dict[str, Any]) -> dict[str, Any]:
    return {name: list(value) if isinstance(value, tuple) else value for name, value in record.items()}


def _csv(rows: Sequence[dict[str, Any]]) -> bytes:
    return csv_text(rows, list(rows[0]) if rows else []).encode()


def _level(names: Sequence[str], level: Sequence[str]) -> dict[str, Any]:
    return dict(zip(names, level, strict=True))


def _without_level(record: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in record.items() if name != "level"}


def _cell_row(names: Sequence[str], cell: Cell) -> dict[str, Any]:
    found = cell.pairs
    row: dict[str, Any] = _level(names, cell.level)
    row |= {"method": cell.method, "missions": cell.missions, "pairs": found.asked, "distorted": found.distorted}
    row |= _share("right", found.right) | _share("true_accepts", found.true_accepts)
    row |= _interval("true_accepts_clustered", found.clustered.get("true_accepts"))
    row |= _share("false_accepts", found.false_accepts)
    for name in ERRORS:
        quantiles: Quantiles | None = found.errors_accepted[name]
        row |= {
            f"{name}_median": quantiles and quantiles.median,
            f"{name}_p90": quantiles and quantiles.p90,
        }
    row["acceptance_index"] = found.acceptance_index
    for name in MEANS:
        mean: Mean | None = getattr(cell, name)
        row |= {name: mean and mean.value} | _interval(name, mean.interval if mean else None)
    return row


def _share(name: str, share: Share | None) -> dict[str, Any]:
    row = {
        name: share and share.count,
        f"{name}_of": share and share.of,
        f"{name}_share": share and share.value,
    }
    return row | _interval(f"{name}_share", share.interval if share else None)


def _interval(name: str, interval: Interval | None) -> dict[str, Any]:
    return {
        f"{name}_low": interval and interval.low,
        f"{name}_high": interval and interval.high,
    }


def _test_row(test: PairedTest) -> dict[str, Any]:
    record = {"level": " ".join(test.level)} | _without_level(dataclasses.asdict(test))
    del record["interval"]
    return record | _interval("difference", test.interval) | {"verdict": test.verdict}


def trials_journal(folder: Path) -> Journal[MissionTask]:
    """Open the journal of finished missions."""
    return Journal(folder / TRIALS_FILE, lambda task: str(task.index), _check_entry)


def _check_entry(entry: Entry, place: str) -> None:
    require_shape(entry, {"pairs": [dict], "teams": [TEAM], "failures": [FAILURE]}, place)
    for team in entry["teams"]:
        if not 0 <= team["joined"] <= team["maps"] or team["maps"] == 0:
            raise ValueError(f"{place}: {team['joined']} of {team['maps']} maps joined")
    with reading(place):
        trials_from_record(entry)


def is_study(folder: Path) -> bool:
    """Check if the folder holds a study, finished or not."""
    return (folder / PLAN_FILE).is_file()


def load_results(folder: Path) -> StudyResults:
    """Load the results of all finished missions. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    path = folder / PLAN_FILE
    record = read_json(path)
    check_record(path, "plan", record)
    plan = plan_from_record(record)
    entries = [entry for _, entry in sorted(trials_journal(folder).entries().items(), key=lambda item: int(item[0]))]
    missions = [trials_from_record(entry) for entry in entries]
    pairs = [pair for trials in missions for pair in trials.pairs]
    teams = [team for trials in missions for team in trials.teams]
    planned = [(level, method.title) for level in plan.levels for method in plan.methods]
    for level, method in (
        *((one.pair.level, one.method) for one in pairs),
        *((one.level, one.method) for one in teams),
    ):
        if (level, method) not in planned:
            raise ValueError(f"{folder / TRIALS_FILE}: {method!r} at the level {list(level)} is not of the plan")
    return build_results(plan, pairs, teams, [failure for trials in missions for failure in trials.failures])
