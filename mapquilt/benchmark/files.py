"""Folder of a benchmark: pairs.csv, summary.json, timings.json, table.md and pictures."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from pathlib import Path
from typing import Any, TextIO

from mapping.io.safe_load import MAX_BYTES, read_json, read_limited, reading
from mapping.io.shape import require_shape
from mapping.io.transaction import added_files, atomic_folder
from mapquilt.benchmark.results import BenchmarkResults
from mapquilt.benchmark.table import markdown
from mapquilt.evaluation.calibration import Calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.pair_rows import from_row, read_csv_row, to_row, write_csv
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
        with (folder / PAIRS_FILE).open("w", encoding="utf-8", newline="") as file:
            write_csv(file, (to_row(one, out.resolve().parent) for one in results.answers))
        write_record(folder / SUMMARY_FILE, "summary", summary_record(results, settings))
        with (folder / TIMINGS_FILE).open("w", encoding="utf-8") as file:
            write_timings(file, results)
        (folder / TABLE_FILE).write_text(markdown(results), encoding="utf-8")
    with added_files(out) as folder:
        if results.calibrations:
            (folder / RELIABILITY_PICTURE).write_bytes(figure_png(reliability_figure(results.calibrations)))
        if pictures:
            (folder / SHEETS_FOLDER).mkdir()
            _draw_sheets(folder / SHEETS_FOLDER, results, pictures, on_progress)


def _draw_sheets(folder: Path, results: BenchmarkResults, pictures: int, on_progress: Progress) -> None:
    ranked = most_relevant_first(results.answers)
    for done, method in enumerate(results.methods, start=1):
        for number, page in enumerate(sheet_pages(results.answers, ranked.get(method, ())[:pictures]), start=1):
            (folder / f"{method.replace(' ', '-')}-{number:02d}.png").write_bytes(page)
        on_progress(done, len(results.methods))


def summary_record(results: BenchmarkResults, settings: dict[str, Any]) -> dict[str, Any]:
    """Build the content of summary.json: settings, aggregates and calibration, without times."""
    return {
        "schema": SCHEMA,
        "methods": list(results.methods),
        **settings,
        "sets": list(results.sets),
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


def write_timings(file: TextIO, results: BenchmarkResults) -> None:
    """Write timings.json: medians and ratios by stratum, then the seconds of every pair, a line each."""
    strata = [
        {"group": row.group, "stratum": row.stratum, "method": row.method, **dataclasses.asdict(row.timing)}
        for row in results.strata
        if row.timing is not None
    ]
    head = to_text({"unit": "s", "threads": 1, "strata": strata})
    file.write(head.removesuffix("\n}\n") + ',\n  "pairs": [')
    separator = "\n"
    for one in results.answers:
        if one.seconds is not None:
            record = {"set": one.pair.suite, "pair": one.pair.name, "method": one.method, "seconds": one.seconds}
            file.write(f"{separator}    {json.dumps(record, allow_nan=False, ensure_ascii=False)}")
            separator = ",\n"
    file.write("\n  ]\n}\n")


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
