"""pairs.csv, summary.json, timings.json and table.md of a benchmark."""

from __future__ import annotations

import csv
import dataclasses
import io
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mapquilt.benchmark.report import Report
from mapquilt.benchmark.table import markdown
from mapquilt.benchmark.trial import Answer, Trial
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.transform_error import TransformError
from mapquilt.json_file import similarity_record, to_text, write_record
from merge.records.result import Evidence

SCHEMA = "mapquilt-benchmark/1"
PAIRS_FILE, SUMMARY_FILE, TIMINGS_FILE, TABLE_FILE = "pairs.csv", "summary.json", "timings.json", "table.md"

ERRORS = tuple(field.name for field in dataclasses.fields(TransformError))
EVIDENCE = tuple(field.name for field in dataclasses.fields(Evidence))
PLACE = ("x", "y", "yaw", "scale")
COLUMNS = (
    "method",
    "set",
    "pair",
    "subset",
    "world",
    "noise",
    "true_overlap",
    "negative",
    "identifiable",
    "bent",
    "accepted",
    "right",
    "confidence",
    *ERRORS,
    *PLACE,
    *EVIDENCE,
    "reason",
    *(f"true_{part}" for part in PLACE),
    *(f"runner_up_{part}" for part in PLACE),
    "runner_up_score",
    "mission",
    "target_map",
    "source_map",
)


def write_files(folder: Path, report: Report) -> None:
    """Write all four; times are in the last two alone."""
    (folder / PAIRS_FILE).write_text(pairs_csv(report, folder.parent), encoding="utf-8")
    write_record(folder / SUMMARY_FILE, "summary", summary_record(report))
    (folder / TIMINGS_FILE).write_text(to_text(timings_record(report)), encoding="utf-8")
    (folder / TABLE_FILE).write_text(markdown(report), encoding="utf-8")


def pairs_csv(report: Report, beside: Path) -> str:
    """One row a method and pair; what does not apply is left empty. Maps are told relative to the folder ``beside``
    which the benchmark's own lies in."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_row(trial, answer) | _places(trial, answer, beside) for answer, trial in _answers(report))
    return text.getvalue()


def _answers(report: Report) -> Iterator[tuple[Answer, Trial]]:
    for method in range(len(report.methods)):
        for trial in report.trials:
            yield trial.answers[method], trial


def _row(trial: Trial, answer: Answer) -> dict[str, Any]:
    pair = trial.pair
    place, error, evidence = answer.target_from_source, answer.error, answer.evidence
    row = {
        "method": answer.method,
        "set": pair.suite,
        "pair": pair.name,
        "subset": pair.subset,
        "world": pair.world,
        "noise": pair.noise,
        "true_overlap": pair.overlap,
        "negative": trial.negative,
        "identifiable": None if trial.negative else pair.identifiable,
        "bent": None if trial.negative else trial.bent,
        "accepted": answer.accepted,
        "right": None if trial.negative else answer.right,
        "confidence": answer.confidence,
        "reason": answer.reason,
    }
    row |= {} if error is None else dataclasses.asdict(error)
    row |= {} if place is None else similarity_record(place)
    return row | ({} if evidence is None else dataclasses.asdict(evidence))


def _places(trial: Trial, answer: Answer, beside: Path) -> dict[str, Any]:
    pair, other = trial.pair, answer.runner_up
    row: dict[str, Any] = {
        "mission": pair.mission,
        "target_map": os.path.relpath(pair.target_path.resolve(), beside.resolve()),
        "source_map": os.path.relpath(pair.source_path.resolve(), beside.resolve()),
    }
    if trial.truth is not None:
        row |= {f"true_{part}": value for part, value in similarity_record(trial.truth).items()}
    if other is not None:
        row |= {f"runner_up_{part}": value for part, value in similarity_record(other.target_from_source).items()}
        row |= {"runner_up_score": other.score}
    return row


def summary_record(report: Report) -> dict[str, Any]:
    """What was run, every count, and the calibration; schema ``summary``. No times: the same call gives the same."""
    scale = report.methods[0].scale
    return {
        "schema": SCHEMA,
        "methods": [settings.title for settings in report.methods],
        "scale": "auto" if scale is None else f"{scale.low:g}:{scale.high:g}",
        "seed": report.seed,
        "sets": sorted({trial.pair.suite for trial in report.trials}),
        "strata": [dataclasses.asdict(tally) for tally in report.tallies],
        "calibration": [calibration_record(found) for found in report.calibrations],
    }


def calibration_record(found: Calibration) -> dict[str, Any]:
    """Of one method, as summary.json and calibration.json hold it."""
    return dataclasses.asdict(found) | {"bins": [dataclasses.asdict(one) for one in found.bins]}


def timings_record(report: Report) -> dict[str, Any]:
    """Medians and ratios by stratum, and the seconds of every pair."""
    return {
        "unit": "s",
        "threads": 1,
        "strata": [dataclasses.asdict(timing) for timing in report.timings],
        "pairs": [
            {"set": trial.pair.suite, "pair": trial.pair.name, "method": answer.method, "seconds": answer.seconds}
            for answer, trial in _answers(report)
        ],
    }
