"""Answers of methods, their scores, and the check that recomputes them."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.leaderboard.result_file import SHARES, read_results
from mapping.grid.pixel_matrix import pixel_matrix
from mapquilt.benchmark.exchange.answers import COLUMNS, read_answers
from mapquilt.benchmark.exchange.identity import data_digest
from mapquilt.benchmark.pair import BenchmarkPair
from mapquilt.benchmark.results import StratumResult, build_results
from mapquilt.benchmark.trials import run_benchmark
from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.evaluation.statistics import Interval, Share
from mapquilt.jobs.progress import count_progress
from mapquilt.jobs.runner import Runner, Workers

GROUPS = ("positives", "not identifiable", "distorted", "poses", "negatives", "every pair")
"""Groups of strata that a result file keeps."""


def answer_rows(found: Sequence[EvaluatedPair], pairs: Mapping[str, BenchmarkPair]) -> list[dict[str, Any]]:
    """Convert answers to rows of an answers file, rounded to a thousandth of a pixel at 1,000 pixels."""
    by_title = {one.pair.title: one for one in found}
    rows = []
    for name, pair in pairs.items():
        one = by_title[pair.info.title]
        row: dict[str, Any] = {
            "pair": name,
            "confidence": f"{one.confidence or 0.0:.6f}",
            "accepted": int(bool(one.accepted)),
            "seconds": "" if one.seconds is None else f"{one.seconds:.4g}",
        }
        if one.answer is not None:
            target, source = pair.maps().grids
            (a, _, x), (b, _, y) = pixel_matrix(target.frame, one.answer, source.frame)
            turn = math.degrees(math.atan2(b, a))
            row |= {
                "scale": f"{math.hypot(a, b):.7g}",
                "rotation_deg": f"{turn:.5f}",
                "tx": f"{x:.3f}",
                "ty": f"{y:.3f}",
            }
        rows.append(row)
    return rows


def write_answers(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write an answers file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def scored(answers: Path, pairs: Mapping[str, BenchmarkPair]) -> dict[str, Any]:
    """Score an answers file: the median time, and the counts of every stratum.

    Raises ``ValueError`` or ``OSError`` naming the file and the row that is wrong.
    """
    given = read_answers(answers, answers.stem, pairs)
    with Runner(Workers(1)) as runner, count_progress(answers.name) as on_progress:
        found = run_benchmark(
            list(pairs.values()), (), 0, runner, on_progress, given=[(given[name],) for name in pairs]
        )
    seconds = [one.seconds for one in found if one.seconds is not None]
    return {
        "median_s": float(np.median(seconds)) if len(seconds) == len(found) else None,
        "strata": [_stratum(row) for row in build_results(found, 0).strata if row.group in GROUPS],
    }


def _stratum(row: StratumResult) -> dict[str, Any]:
    found = row.aggregate
    return {
        "group": row.group,
        "stratum": row.stratum,
        "pairs": found.pairs,
        **{name: _counted(getattr(found, name), found.clustered.get(name)) for name in SHARES},
    }


def _counted(share: Share | None, interval: Interval | None) -> list[float] | None:
    """Shorten a share to its count, of how many, and its interval over worlds where there is one."""
    ends = () if interval is None else (round(interval.low, 4), round(interval.high, 4))
    return None if share is None else [share.count, share.of, *ends]


def differences(path: Path, record: Mapping[str, Any], pairs: Mapping[str, BenchmarkPair]) -> list[str]:
    """Score the answers of a result again, and name every number that differs."""
    again = scored(path.with_suffix(".csv"), pairs)
    lines = []
    if again["median_s"] != record["median_s"]:
        lines.append(f"{path}: median_s is {record['median_s']}, the answers give {again['median_s']}")
    for was, now in zip(record["strata"], again["strata"], strict=False):
        for name in now:
            if was[name] != now[name]:
                where = f"{was['group']}, {was['stratum']}"
                lines.append(f"{path}: {where}: {name} is {was[name]}, the answers give {now[name]}")
    if len(again["strata"]) != len(record["strata"]):
        lines.append(f"{path}: has {len(record['strata'])} strata, the answers give {len(again['strata'])}")
    return lines


def check(root: Path, at_hand: Sequence[Mapping[str, BenchmarkPair]]) -> dict[Path, list[str] | None]:
    """Check all result files, and recompute those whose data is at hand, as ``by_identity`` names it.

    Returns the differences of each file; None where its data is not at hand. Raises ``ValueError`` naming a file that
    is wrong in itself.
    """
    data = {data_digest(list(pairs.values())): pairs for pairs in at_hand}
    return {
        path: differences(path, record, data[record["data"]["digest"]]) if record["data"]["digest"] in data else None
        for path, record in read_results(root).items()
    }
