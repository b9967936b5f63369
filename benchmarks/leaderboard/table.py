"""Tables and pictures of the leaderboard, one of each data set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from benchmarks.leaderboard.result_file import ROOT, SHARES, read_results
from mapquilt.viz.palette import OUTCOME_COLOURS

WORDS = ("method", "version", "reference", "run")
HEADINGS = (
    *("method", "version", "reference", "true accepts, %", "at 30 % overlap and more, %", "false accepts"),
    *("accepted right, %", "s", "run"),
)


def leaderboard_tables(root: Path = ROOT) -> str:
    """Draw the results of each data set as a picture and a Markdown table, most true accepts first."""
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
            f"<div>{leaderboard_picture(rows)}</div>\n",
            f"| {' | '.join(HEADINGS)} |",
            f"|{'|'.join('---' if heading in WORDS else '---:' for heading in HEADINGS)}|",
            *(f"| {' | '.join(_cells(record))} |" for record in rows),
            "",
        ]
    return "\n".join(parts)


LABELS, BARS, STEP = 300, 600, 26
"""Widths of names and bars, and height of a row [pixels]."""

TRUE_COLOUR, FALSE_COLOUR = OUTCOME_COLOURS["true accept"], OUTCOME_COLOURS["false accept"]


def leaderboard_picture(records: Sequence[Mapping[str, Any]]) -> str:
    """Draw bars as SVG on one line: true accepts of the positives with their interval, false accepts of every pair."""
    width, height = LABELS + BARS + 40, STEP * (len(records) + 2)
    parts = [
        f'<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg" role="img" font-size="13" '
        'fill="currentColor" aria-label="True and false accepts of each method">',
        f'<text x="{LABELS}" y="17"><tspan fill="{TRUE_COLOUR}">■ true accepts of positives</tspan> '
        f'<tspan fill="{FALSE_COLOUR}">■ false accepts of every pair</tspan></text>',
    ]
    for number, record in enumerate(records, start=1):
        top = number * STEP
        parts.append(f'<text x="{LABELS - 8}" y="{top + 15}" text-anchor="end">{escape(record["method"])}</text>')
        for share, y, colour in (
            (_row(record, "positives", "all")["true_accepts"], top + 3, TRUE_COLOUR),
            (_row(record, "every pair", "all")["false_accepts"], top + 13, FALSE_COLOUR),
        ):
            parts += [] if not share else _bar(share, y, colour)
    foot = (len(records) + 1) * STEP + 15
    parts += [
        f'<text x="{LABELS + BARS * percent // 100}" y="{foot}" text-anchor="middle">{percent} %</text>'
        for percent in (0, 25, 50, 75, 100)
    ]
    return "".join((*parts, "</svg>"))


def _bar(share: Sequence[float], y: int, colour: str) -> list[str]:
    """Draw a share as a bar, with its interval as a line."""
    count, total, *ends = share
    parts = [f'<rect x="{LABELS}" y="{y}" width="{BARS * count / total:.1f}" height="8" fill="{colour}"/>']
    if ends:
        low, high = (LABELS + BARS * end for end in ends)
        parts.append(f'<path d="M{low:.1f} {y + 4}H{high:.1f}" stroke="currentColor" stroke-width="1.2"/>')
    return parts


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
