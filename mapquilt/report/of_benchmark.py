"""A benchmark: what there is to report of it."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from mapping.geometry.similarity2 import Similarity2
from mapping.io.safe_load import read_json
from mapquilt.benchmark.files import PAIRS_FILE, PLACE, SUMMARY_FILE, TIMINGS_FILE
from mapquilt.benchmark.table import number_text, share_text, wrong_text
from mapquilt.evaluation.statistics import Interval, Share
from mapquilt.json_file import read_record
from mapquilt.report.answer import ReportAnswer
from mapquilt.report.content import Content, Sheet

COLUMNS = (
    ("stratum", False),
    ("method", False),
    ("pairs", True),
    ("right", True),
    ("right and accepted", True),
    ("wrong accepts", True),
    ("rotation [deg]", True),
    ("scale [%]", True),
    ("displacement [cells]", True),
)


def benchmark_content(folder: Path) -> Content:
    """A benchmark. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    summary = read_record(folder / SUMMARY_FILE, "summary")
    return Content(
        kind="benchmark",
        name=folder.resolve().name,
        settings={
            "sets of pairs": ", ".join(summary["sets"]),
            "methods": ", ".join(summary["methods"]),
            "scales searched": summary["scale"],
            "seed": str(summary["seed"]),
        },
        answers=_answers(folder),
        sheets=[
            Sheet(
                "Strata",
                "Shares in per cent with Wilson's 95 % interval, in square brackets that of a bootstrap over missions; "
                "errors are medians of the right answers.",
                COLUMNS,
                [_stratum(entry) for entry in summary["strata"]],
            )
        ],
    )


def _answers(folder: Path) -> tuple[ReportAnswer, ...]:
    path = folder / PAIRS_FILE
    timings = read_json(folder / TIMINGS_FILE)
    try:
        seconds = {(one["set"], one["pair"], one["method"]): float(one["seconds"]) for one in timings["pairs"]}
        with path.open(encoding="utf-8", newline="") as file:
            return tuple(_answer(row, seconds, folder.resolve().parent) for row in csv.DictReader(file))
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: is damaged or of an older version ({error}); run the benchmark again") from None


def _answer(row: dict[str, str], seconds: dict[tuple[str, str, str], float], beside: Path) -> ReportAnswer:
    negative = row["negative"] == "True"
    return ReportAnswer(
        pair=f"{row['set']}: {row['pair']}",
        cluster=row["mission"] or row["pair"],
        target=beside / row["target_map"],
        source=beside / row["source_map"],
        method=row["method"],
        world=row["world"] or None,
        noise=_number(row["noise"]),
        overlap=_number(row["true_overlap"]),
        negative=negative,
        identifiable=row["identifiable"] == "True",
        bent=row["bent"] == "True",
        accepted=row["accepted"] == "True",
        right=row["right"] == "True",
        confidence=_number(row["confidence"]),
        rotation_deg=_number(row["rotation_deg"]),
        scale_percent=_number(row["scale_percent"]),
        displacement_m=_number(row["displacement_m"]),
        displacement_cells=_number(row["displacement_cells"]),
        reason=row["reason"] or None,
        score=_number(row["score"]),
        runner_up_score=_number(row["runner_up_score"]) or _number(row["second_best_score"]) or None,
        seconds=seconds.get((row["set"], row["pair"], row["method"])),
        answer=_place(row, ""),
        truth=None if negative else _place(row, "true_"),
        runner_up=_place(row, "runner_up_"),
    )


def _number(text: str) -> float | None:
    return float(text) if text else None


def _place(row: dict[str, str], prefix: str) -> Similarity2 | None:
    numbers = [_number(row[f"{prefix}{part}"]) for part in PLACE]
    known = [number for number in numbers if number is not None]
    return Similarity2(*known) if len(known) == len(PLACE) else None


def _stratum(entry: dict[str, Any]) -> list[str]:
    over = {name: Interval(**interval) for name, interval in entry["over_missions"].items()}
    return [
        entry["stratum"] if entry["stratum"] != "all" else f"all {entry['group']}",
        entry["method"],
        str(entry["pairs"]),
        share_text(_share(entry["right"]), over.get("right")),
        share_text(_share(entry["right_and_accepted"]), over.get("right_and_accepted")),
        wrong_text(Share(**entry["wrong_accepts"] | {"interval": Interval(**entry["wrong_accepts"]["interval"])})),
        number_text(entry["rotation_deg"], 3),
        number_text(entry["scale_percent"], 3),
        number_text(entry["displacement_cells"], 2),
    ]


def _share(record: dict[str, Any] | None) -> Share | None:
    return None if record is None else Share(record["count"], record["of"], Interval(**record["interval"]))
