"""Folder of a benchmark: pairs.csv, summary.json, timings.json, table.md and pictures."""

from __future__ import annotations

import csv
import dataclasses
import io
from pathlib import Path
from typing import Any

from mapping.io.safe_load import MAX_BYTES, read_json, read_limited, reading
from mapping.io.shape import require_shape
from mapping.io.transaction import atomic_folder, change_files
from mapquilt.benchmark.results import BenchmarkResults
from mapquilt.benchmark.table import markdown
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.pair_rows import csv_text, from_row, read_csv_row, to_row
from mapquilt.jobs.runner import Progress, no_progress
from mapquilt.json_file import read_record, to_text, write_record
from mapquilt.viz.pair_sheet import most_relevant_first, sheet_pages
from mapquilt.viz.png import figure_png
from mapquilt.viz.reliability import reliability_figure

SCHEMA = "mapquilt-benchmark/3"
PAIRS_FILE, SUMMARY_FILE, TIMINGS_FILE, TABLE_FILE = "pairs.csv", "summary.json", "timings.json", "table.md"
RELIABILITY_PICTURE = "reliability.png"
SHEETS_FOLDER = "sheets"


def write_folder(
    out: Path,
    results: BenchmarkResults,
    settings: dict[str, Any],
    pictures: int,
    on_progress: Progress = no_progress,
) -> None:
    """Write tables and records, all or nothing, then draw pictures and write them; a benchmark there is replaced.

    ``settings`` are scale, seed and the digest of the data, as summary.json names them. At most ``pictures`` pairs a
    method are drawn, errors first. Times are in timings.json and table.md alone.
    """
    with atomic_folder(out, ledger=True) as folder:
        rows = (to_row(one, out.resolve().parent) for one in results.answers)
        (folder / PAIRS_FILE).write_text(csv_text(rows), encoding="utf-8")
        write_record(folder / SUMMARY_FILE, "summary", summary_record(results, settings))
        (folder / TIMINGS_FILE).write_text(to_text(timings_record(results)), encoding="utf-8")
        (folder / TABLE_FILE).write_text(markdown(results), encoding="utf-8")
    drawn: dict[Path, bytes] = {}
    if results.calibrations:
        drawn[out / RELIABILITY_PICTURE] = figure_png(reliability_figure(results.calibrations))
    if pictures:
        drawn |= _sheets(out / SHEETS_FOLDER, results, pictures, on_progress)
    change_files(out, drawn, (), ledger=True)


def _sheets(folder: Path, results: BenchmarkResults, pictures: int, on_progress: Progress) -> dict[Path, bytes]:
    pages = {}
    for done, method in enumerate(results.methods, start=1):
        shown = most_relevant_first(results.of_method(method))[:pictures]
        for number, page in enumerate(sheet_pages(shown), start=1):
            pages[folder / f"{method.replace(' ', '-')}-{number:02d}.png"] = page
        on_progress(done, len(results.methods))
    return pages


def summary_record(results: BenchmarkResults, settings: dict[str, Any]) -> dict[str, Any]:
    """Build the content of summary.json: settings, aggregates and calibration, without times."""
    return {
        "schema": SCHEMA,
        "methods": list(results.methods),
        **settings,
        "sets": sorted({one.pair.suite for one in results.answers}),
        "strata": [
            {"group": row.group, "stratum": row.stratum, "method": row.method, **dataclasses.asdict(row.aggregate)}
            for row in results.strata
        ],
        "comparisons": [dataclasses.asdict(one) for one in results.comparisons],
        "calibration": [calibration_record(found) for found in results.calibrations],
    }


def calibration_record(found: Calibration) -> dict[str, Any]:
    """Build the record of one method's calibration, as in summary.json and calibration.json."""
    return dataclasses.asdict(found) | {"bins": [dataclasses.asdict(one) for one in found.bins]}


def timings_record(results: BenchmarkResults) -> dict[str, Any]:
    """Build the content of timings.json: medians and ratios by stratum, and the seconds of every pair."""
    return {
        "unit": "s",
        "threads": 1,
        "strata": [
            {"group": row.group, "stratum": row.stratum, "method": row.method, **dataclasses.asdict(row.timing)}
            for row in results.strata
            if row.timing is not None
        ],
        "pairs": [
            {"set": one.pair.suite, "pair": one.pair.name, "method": one.method, "seconds": one.seconds}
            for one in results.answers
            if one.seconds is not None
        ],
    }


def load_answers(folder: Path) -> tuple[dict[str, Any], list[EvaluatedPair]]:
    """Read the summary and all answers of a benchmark, of this version or the one before.

    Raises ``ValueError`` or ``OSError`` naming the file that is wrong.
    """
    path = folder / PAIRS_FILE
    summary = read_record(folder / SUMMARY_FILE, "summary")
    timings = read_json(folder / TIMINGS_FILE)
    require_shape(
        timings, {"pairs": [{"set": str, "pair": str, "method": str, "seconds": float}]}, str(folder / TIMINGS_FILE)
    )
    seconds = {(one["set"], one["pair"], one["method"]): float(one["seconds"]) for one in timings["pairs"]}
    with reading(path):
        rows = csv.DictReader(io.StringIO(read_limited(path, MAX_BYTES).decode("utf-8"), newline=""), restkey="")
        answers = [from_row(read_csv_row(row), folder.resolve().parent) for row in rows]
    return summary, [
        dataclasses.replace(one, seconds=seconds.get((one.pair.suite, one.pair.name, one.method))) for one in answers
    ]
