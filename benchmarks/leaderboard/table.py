"""Tables of the leaderboard, one of each data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.leaderboard.result_file import ROOT, SHARES, read_results

WORDS = ("method", "version", "reference", "run")
HEADINGS = (
    *("method", "version", "reference", "true accepts, %", "at 30 % overlap and more, %", "false accepts"),
    *("accepted right, %", "s", "run"),
)


def leaderboard_tables(root: Path = ROOT) -> str:
    """Draw the results of each data set as a Markdown table, most true accepts first."""
    parts = []
    results = read_results(root)
    for folder in sorted({path.parent for path in results}):
        records = [record for path, record in results.items() if path.parent == folder]
        data = records[0]["data"]
        part = "" if data["split"] is None else f", split {data['split']}"
        part += "" if data["limit"] is None else f", drawn evenly by `--limit {data['limit']}`"
        rows = sorted(records, key=lambda record: (-_count(record, "true_accepts"), _count(record, "false_accepts")))
        parts += [
            f"## {folder.name}\n",
            f"{data['pairs']} pairs{part}; `{data['made_by']}`; digest `{data['digest'][:16]}`.\n",
            f"| {' | '.join(HEADINGS)} |",
            f"|{'|'.join('---' if heading in WORDS else '---:' for heading in HEADINGS)}|",
            *(f"| {' | '.join(_cells(record))} |" for record in rows),
            "",
        ]
    return "\n".join(parts)


def _cells(record: Mapping[str, Any]) -> tuple[str, ...]:
    every = _row(record, "every pair", "all")
    return (
        record["method"] + (f"; {record['note']}" if record["note"] else ""),
        record["version"],
        record["reference"],
        _share(_row(record, "positives", "all")["true_accepts"]),
        _share(_row(record, "positives", "overlap 30 % and more")["true_accepts"]),
        f"{every['false_accepts'][0]} of {every['false_accepts'][1]}",
        _share(every["accepted_right"]),
        "-" if record["median_s"] is None else f"{record['median_s']:.3g}",
        f"{record['origin']} by {record['ran_by']}, {record['date']}",
    )


def _row(record: Mapping[str, Any], group: str, stratum: str) -> Mapping[str, Any]:
    """Return a stratum of a result; without any share if the data has none of the kind."""
    found = [row for row in record["strata"] if (row["group"], row["stratum"]) == (group, stratum)]
    return found[0] if found else dict.fromkeys(SHARES)


def _count(record: Mapping[str, Any], share: str) -> int:
    group = "every pair" if share == "false_accepts" else "positives"
    return int((_row(record, group, "all")[share] or [0])[0])


def _share(share: Sequence[float] | None) -> str:
    if not share:
        return "-"
    count, total, *ends = share
    interval = f" ({100 * ends[0]:.1f} to {100 * ends[1]:.1f})" if ends else ""
    return f"{100 * count / total:.1f}{interval}"
