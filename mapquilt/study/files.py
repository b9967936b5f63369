"""The files of a study: tables as CSV and Markdown, everything that was counted as JSON, times apart."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from mapquilt.evaluation.statistics import Interval, Share
from mapquilt.json_file import record_bytes, to_text
from mapquilt.study.counting import Cell, Mean, Spread
from mapquilt.study.paired import PairedTest
from mapquilt.study.record import study_record
from mapquilt.study.results import StudyResults
from mapquilt.study.trial import PairTrial

STUDY_FILE, RESULTS_FILE, PAIRS_FILE, TESTS_FILE = "study.json", "results.csv", "pairs.csv", "tests.csv"
TIMINGS_FILE, TIMES_FILE = "timings.json", "timings.csv"
SPREADS = ("rotation_deg", "scale_percent", "displacement_m", "displacement_of_diagonal")
MEANS = ("iou_free", "f1_walls", "joined")
PLACE = ("x", "y", "yaw", "scale")


def table_files(folder: Path, results: StudyResults) -> dict[Path, bytes]:
    """All tables and records, as bytes; times are in the last two alone."""
    names = [one.variable.name for one in results.plan.varied]
    times = [dataclasses.asdict(time) for time in results.times]
    return {
        folder / RESULTS_FILE: csv_bytes(_cell_row(names, cell) for cell in results.cells),
        folder / PAIRS_FILE: csv_bytes(_pair_row(names, trial) for trial in results.pairs),
        folder / TESTS_FILE: csv_bytes(_test_row(test) for test in results.tests),
        folder / STUDY_FILE: record_bytes(folder / STUDY_FILE, "study", study_record(results)),
        folder / TIMINGS_FILE: to_text({"unit": "s", "threads": 1, "cells": times}).encode(),
        folder / TIMES_FILE: csv_bytes(_level(names, time["level"]) | _but_level(time) for time in times),
    }


def csv_bytes(rows: Iterable[dict[str, Any]]) -> bytes:
    """Rows of equal columns; what does not apply is left empty. Nothing but the line's end where there is no row."""
    found = list(rows)
    text = io.StringIO()
    writer = csv.DictWriter(text, list(found[0]) if found else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    return text.getvalue().encode()


def _level(names: Sequence[str], level: Sequence[str]) -> dict[str, Any]:
    return dict(zip(names, level, strict=True))


def _but_level(record: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in record.items() if name != "level"}


def _cell_row(names: Sequence[str], cell: Cell) -> dict[str, Any]:
    row: dict[str, Any] = _level(names, cell.level)
    row |= {"method": cell.method, "missions": cell.missions, "pairs": cell.pairs, "bent": cell.bent}
    row |= _share("right", cell.right) | _share("right_and_accepted", cell.right_and_accepted)
    row |= _interval("right_and_accepted_over_missions", cell.over_missions)
    row |= _share("wrong_accepts", cell.wrong_accepts)
    for name in SPREADS:
        spread: Spread | None = getattr(cell, name)
        row |= {f"{name}_median": spread and spread.median, f"{name}_p90": spread and spread.p90}
    row["acceptance_index"] = cell.acceptance_index
    for name in MEANS:
        mean: Mean | None = getattr(cell, name)
        row |= {name: mean and mean.value} | _interval(name, None if mean is None else mean.interval)
    return row


def _share(name: str, share: Share | None) -> dict[str, Any]:
    told = {name: share and share.count, f"{name}_of": share and share.of, f"{name}_share": share and share.value}
    return told | _interval(f"{name}_share", None if share is None else share.interval)


def _interval(name: str, interval: Interval | None) -> dict[str, Any]:
    return {f"{name}_low": interval and interval.low, f"{name}_high": interval and interval.high}


def _pair_row(names: Sequence[str], trial: PairTrial) -> dict[str, Any]:
    told = _but_level(dataclasses.asdict(trial))
    told["true_overlap"] = told.pop("overlap")
    level = _level(names, trial.level)
    record = level | told | level
    for name in ("answer", "truth", "runner_up"):
        place = record.pop(name) or (None,) * len(PLACE)
        record |= {f"{name}_{part}": value for part, value in zip(PLACE, place, strict=True)}
    return record


def _test_row(test: PairedTest) -> dict[str, Any]:
    record = {"level": " ".join(test.level)} | _but_level(dataclasses.asdict(test))
    del record["interval"]
    return record | _interval("difference", test.interval) | {"verdict": test.verdict}
