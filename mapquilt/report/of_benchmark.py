"""Content of a report on a benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mapquilt.benchmark.comparison import Comparison
from mapquilt.benchmark.files import load_answers
from mapquilt.benchmark.results import build_results
from mapquilt.benchmark.table import (
    COLUMNS,
    COMPARISON_COLUMNS,
    WORDS,
    comparison_cells,
    comparisons_text,
    stratum_cells,
)
from mapquilt.report.content import Content, Sheet


def benchmark_content(folder: Path) -> Content:
    """Read a benchmark. Raises ``ValueError`` or ``OSError`` naming the file that is wrong."""
    summary, answers = load_answers(folder)
    results = build_results(answers, summary["seed"])
    rows = [
        (f"{row.group}: {row.stratum}" if row.stratum != "all" else row.group, *stratum_cells(row)[1:])
        for row in results.strata
    ]
    return Content(
        kind="benchmark",
        name=folder.resolve().name,
        settings={
            "sets of pairs": ", ".join(summary["sets"]),
            "methods": ", ".join(summary["methods"]),
            "scales searched": summary["scale"],
            "seed": str(summary["seed"]),
        },
        answers=tuple(answers),
        sheets=[
            Sheet(
                "Strata",
                "Shares in per cent with Wilson's 95 % interval, in square brackets that of a bootstrap over worlds; "
                "errors are medians of the right answers.",
                _headings(COLUMNS),
                rows,
            ),
            *_comparisons(results.comparisons),
        ],
    )


def _headings(columns: Sequence[str]) -> list[tuple[str, bool]]:
    return [(column, column not in WORDS) for column in columns]


def _comparisons(found: Sequence[Comparison]) -> list[Sheet]:
    if not found:
        return []
    rows = [comparison_cells(one) for one in found]
    return [Sheet("Comparisons", comparisons_text(found), _headings(COMPARISON_COLUMNS), rows)]
