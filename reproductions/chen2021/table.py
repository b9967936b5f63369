"""Tables of the reproduction: Markdown, CSV, and a short one for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from statistics import median

from rich.table import Table

from mapquilt.evaluation.pair_rows import csv_text
from mapquilt.viz.text_table import plain_table
from merge.fusion import FUSIONS
from reproductions.chen2021.answers import Answer
from reproductions.chen2021.cases import (
    CASES,
    FACTORS,
    FULL,
    HALL_CASES,
    HIGH_LEVEL,
    LEVELS,
    LOW_LEVEL,
    SETS,
    TEAM,
    WHOLE,
    Case,
    factor_name,
    plane_name,
)
from reproductions.chen2021.make import Study
from reproductions.chen2021.methods import (
    ALL_GREYS,
    CONSENSUS,
    CORRECTED,
    CORRECTED_VERIFIED,
    FAST_BRISK,
    ICP,
    ORB,
    OURS,
    PARTS,
    PLAIN,
    PLAIN_VERIFIED,
    TWO_GREYS,
    without,
)
from reproductions.chen2021.tally import Tallies, Tally

MISSING = "-"
COMPARED = (PLAIN, ORB, CORRECTED, OURS)
VARIANTS = {
    "chapter 3, the flow of the research": {
        "chapter 4: SIFT on the maps": PLAIN,
        "chapter 5, descriptors: SIFT on the corrected maps": without(CONSENSUS),
        "chapter 5, geometry: corners, without ICP": without(ICP),
        "chapter 5, geometry and ICP: the correction": CORRECTED,
        "chapter 4, verified by `mapquilt`": PLAIN_VERIFIED,
        "chapter 5, verified by `mapquilt`": CORRECTED_VERIFIED,
    },
    "section 4.6.1, features": {"SIFT": PLAIN, "ORB": ORB, "FAST and BRISK": FAST_BRISK},
    "appendix A, greys of the picture": {"three": PLAIN, "a grey for each probability": ALL_GREYS, "two": TWO_GREYS},
    "the correction, one part left out": {
        "nothing": CORRECTED,
        **{{"binarise": "binarise (unknown is wall)"}.get(part, part): without(part) for part in PARTS},
    },
}
"""Rows of the table of variants, in groups."""


def markdown(study: Study, counted: Tallies) -> str:
    """Write all tables."""
    parts = [
        "# Reproduction of Chen (2021)",
        f"Maps: {study.seeds} pairs per row. Right: within 10 cells, 5 degrees and 5 % of scale; in per cent of all "
        "runs, with Wilson's 95 % interval of so many pairs of maps. A method with random numbers has 5 runs on each.",
        "## Cases, as the thesis's maps are",
        cases_table(counted),
        "## The same with full coverage",
        full_table(counted),
        "## The maps",
        descriptors_table(study),
        "## Acceptance index",
        index_table(counted),
        "## Ablation: overlap and clearing",
        plane_table(counted),
        "## Ablation: one property changed",
        factors_table(counted),
        "## Variants",
        variants_table(counted),
        "## Appendix A: values of cells that both maps know",
        fusion_table(study),
    ]
    return "\n\n".join(parts) + "\n"


def cases_table(counted: Tallies) -> str:
    """Tabulate the thesis's results beside those on maps that overlap as its own."""
    head = ("case", "differs by", "SIFT, thesis", "SIFT %", "corrected, thesis", "corrected %", "quilt %")
    rows = []
    for case in CASES:
        thesis = case.measured
        plain = MISSING if thesis is None else f"{thesis.plain} of 20"
        corrected = MISSING if thesis is None or thesis.corrected is None else f"{thesis.corrected} of 5"
        found = [share(counted[case.name, method]) for method in (PLAIN, CORRECTED, OURS)]
        rows.append((case.name, case.differs, plain, found[0], corrected, *found[1:]))
    team = [share(counted[TEAM, method]) for method in (PLAIN, CORRECTED, OURS)]
    return _table(head, [*rows, (TEAM, "three wings", MISSING, team[0], MISSING, *team[1:])])


def full_table(counted: Tallies) -> str:
    rows = [(case.name, *(share(counted[case.name + FULL, method]) for method in COMPARED)) for case in HALL_CASES]
    return _table(("case", *(f"{method} %" for method in COMPARED)), rows)


def descriptors_table(study: Study) -> str:
    """Tabulate medians of what describes the maps, ranges of the overlap, and the thesis's values in brackets."""
    head = ("case", "overlap of the second", "of the first", "known, first", "known, second")
    rows = []
    for case in CASES:
        found = [one for one in study.descriptors if one.trial == case.name]
        hall = case in HALL_CASES
        rows.append(
            (
                case.name,
                f"{_spread([one.of_second for one in found])} ({case.overlap.of_second:.2f})",
                f"{_spread([one.of_first for one in found])} ({case.overlap.of_first:.2f})",
                *((number(median(one.known[k] for one in found), 2) if hall else MISSING) for k in (0, 1)),
                *(number(median(one.holes[k] for one in found), 2) for k in (0, 1)),
                f"{median(one.pieces[1] for one in found):.0f}" + (f" ({case.pieces})" if case.pieces else ""),
                number(median(one.thickness[1] for one in found), 1),
            )
        )
    return _table((*head, "holes, first", "holes, second", "pieces, second", "thickness, second"), rows)


def index_table(counted: Tallies) -> str:
    """Tabulate the acceptance index of both pipelines, on original rasters and as the thesis computes it."""
    head = ("case", "SIFT", "corrected", "thesis, SIFT", "thesis, at the truth")
    rows = []
    for case in CASES:
        thesis, found = case.measured, [counted[case.name, method] for method in (PLAIN, CORRECTED)]
        if thesis is not None and thesis.reported_index is not None:
            rasters = (*(number(one.index) for one in found), number(thesis.plain_index), number(thesis.true_index))
            greys = (*(number(one.index_of_greys, 4) for one in found), number(thesis.reported_index, 4))
            rows.append((case.name, *rasters, *greys))
    return _table((*head, "SIFT, of greys", "corrected, of greys", "thesis, corrected, of greys"), rows)


def plane_table(counted: Tallies) -> str:
    head = [f"{method}{suffix}" for suffix in (" %", ", cleared") for method in COMPARED]
    rows = []
    for level in (*LEVELS, WHOLE):
        cells = (cell for cleared in (False, True) for cell in _plain(counted, plane_name(level, cleared)))
        rows.append((f"{100 * level:.0f} %" if level < WHOLE else "whole missions", *cells))
    return _table(("overlap", *head), rows)


def factors_table(counted: Tallies) -> str:
    head = [f"{method}, {level:g}" for level in (LOW_LEVEL, HIGH_LEVEL) for method in COMPARED]
    rows = [
        (factor, *(cell for level in (LOW_LEVEL, HIGH_LEVEL) for cell in _plain(counted, factor_name(factor, level))))
        for factor in FACTORS
    ]
    return _table(("changed", *head), rows)


def variants_table(counted: Tallies) -> str:
    rows: list[tuple[str, ...]] = []
    for group, variants in VARIANTS.items():
        rows.append((f"**{group}**", *("" for _ in SETS)))
        rows += [(name, *(share(counted[case.name, method]) for case in SETS)) for name, method in variants.items()]
    return _table(("right %", *(case.name for case in SETS)), rows)


def fusion_table(study: Study) -> str:
    """Tabulate the index of fused maps against the world, by rule."""

    def cell(case: Case, rule: str) -> str:
        return number(median(one.index for one in study.fused if (one.trial, one.rule) == (case.name, rule)), 4)

    rows = [(rule, *(cell(case, rule) for case in SETS)) for rule in FUSIONS]
    return _table(("acceptance index against the world", *(case.name for case in SETS)), rows)


def share(one: Tally) -> str:
    """Write a share with its interval, in per cent."""
    return f"{100 * one.share:.0f} [{100 * one.interval.low:.0f}, {100 * one.interval.high:.0f}]"


def number(value: float | None, digits: int = 3) -> str:
    return MISSING if value is None else f"{value:.{digits}f}"


def _plain(counted: Tallies, trial: str) -> list[str]:
    return [f"{100 * counted[trial, method].share:.0f}" for method in COMPARED]


def _spread(values: Sequence[float]) -> str:
    return f"{median(values):.2f} [{min(values):.2f}, {max(values):.2f}]"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    rule = ["---", *("---:" for _ in head[1:])]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, rule, *rows))


def terminal_table(counted: Tallies) -> Table:
    """Tabulate the shares of right answers by case, in per cent, beside those of the thesis."""
    table = plain_table(
        ("right [%]", False), *((name, True) for name in ("thesis: SIFT", "thesis: corrected", PLAIN, CORRECTED, OURS))
    )
    for case in CASES:
        thesis = case.measured
        plain = MISSING if thesis is None else f"{100 * thesis.plain / 20:.0f}"
        corrected = MISSING if thesis is None or thesis.corrected is None else f"{100 * thesis.corrected / 5:.0f}"
        table.add_row(
            case.name, plain, corrected, *(f"{100 * counted[case.name, m].share:.0f}" for m in (PLAIN, CORRECTED, OURS))
        )
    return table


def answers_csv(study: Study) -> str:
    """Write a row for each answer."""
    return csv_text((asdict(one) for one in study.answers), [field.name for field in fields(Answer)])


TABLE_COLUMNS = (
    *("trial", "method", "maps", "runs", "right", "right_low", "right_high", "false_accepts"),
    *("index", "index_of_greys", "error_cells"),
)


def table_csv(counted: Tallies) -> str:
    """Write a row for each trial and method; what does not apply is left empty."""
    rows = (
        asdict(one) | {"trial": trial, "method": method, "right_low": one.interval.low, "right_high": one.interval.high}
        for (trial, method), one in counted.items()
    )
    return csv_text(rows, TABLE_COLUMNS)
