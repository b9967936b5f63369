"""The HTML page of a report, everything in one file."""

from __future__ import annotations

import json
import math
import re
from importlib.metadata import version
from typing import Any

import jinja2

from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair
from mapquilt.evaluation.formatting import outcome_text
from mapquilt.report.charts import common_charts
from mapquilt.report.content import NOT_MERGED, Chart, Content, methods_of, outcome_rank
from mapquilt.report.gallery import Progress, draw_gallery
from mapquilt.report.pictures import png_address
from mapquilt.report.summary import headline, method_sheet, tiles
from mapquilt.report.svg import figure_svg

COLUMNS = (
    ("pair", False),
    ("outcome", False),
    ("confidence", True),
    ("displacement [m]", True),
    ("rotation [deg]", True),
    ("scale [%]", True),
    ("overlap [%]", True),
    ("time [s]", True),
)

UNMERGED_COLUMNS = (
    ("pair", False),
    ("overlap [%]", True),
    ("one right answer", False),
    ("residual [m]", True),
    ("true yaw [deg]", True),
    ("true scale", True),
)
"""Columns while nothing is merged: the truth of each pair."""

WIDE = 6.5
"""Width [inches] from which a figure takes the whole page."""


def render_page(content: Content, pictures: int, on_progress: Progress = lambda done, total: None) -> str:
    """Render HTML that needs no other file. At most ``pictures`` answers are drawn, errors first.

    Raises ``ValueError`` or ``OSError`` naming a map file that cannot be read.
    """
    answers = content.answers
    gallery = draw_gallery(answers, pictures, on_progress)
    charts = [*content.charts, *common_charts(answers, of_study=content.kind == "study")]
    sheet = method_sheet(answers)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("mapquilt.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(
        content=content,
        headline=headline(content),
        tiles=tiles(content),
        charts=[_chart(f"chart{number}", chart) for number, chart in enumerate(charts)],
        mission=None if content.mission is None else _json(content.mission),
        robots=[] if content.mission is None else [robot["name"] for robot in content.mission["robots"]],
        pictures=[(one, png_address(one.png)) for one in content.pictures],
        sheets=[*([] if sheet is None else [sheet]), *content.sheets],
        parts=_parts,
        columns=_columns(answers),
        rows=[_row(number, one, _columns(answers)) for number, one in enumerate(answers)],
        filters=_filters(answers),
        drawn_numbers=list(gallery.shown),
        thumbs={number: _thumb(places) for number, places in gallery.shown.items()},
        images=_json(gallery.images),
        shown=_json(gallery.shown),
        facts=_json({number: _facts(answers[number]) for number in gallery.shown}),
        generator=f"mapquilt {version('mapquilt')}",
    )


def _chart(name: str, chart: Chart) -> dict[str, Any]:
    return {
        "heading": chart.heading,
        "svg": figure_svg(chart.figure, name),
        "alt": chart.alt,
        "caption": chart.caption,
        "wide": chart.figure.get_figwidth() > WIDE,
    }


def _parts(cell: str) -> list[str]:
    """Split a number from its intervals, which stand below it."""
    return re.split(r" (?=[(\[])", cell)


def _thumb(places: dict[str, int | None]) -> int | None:
    """Choose the picture of a pair in the table: the merge, else the truth, else its target."""
    return next((places[name] for name in ("answer", "truth", "target") if places[name] is not None), None)


def _json(value: Any) -> str:
    """Write JSON that is safe inside a script element: no tag can end it."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")


def _columns(answers: tuple[EvaluatedPair, ...]) -> list[tuple[str, bool]]:
    columns = list(COLUMNS) if methods_of(answers) else list(UNMERGED_COLUMNS)
    if ("time [s]", True) in columns and not any(one.seconds is not None for one in answers):
        columns.remove(("time [s]", True))
    if len({one.pair.world for one in answers}) > 1:
        columns.insert(1, ("world", False))
    if any(one.pair.level for one in answers):
        columns.insert(1, ("level", True))
    elif len({one.pair.noise for one in answers}) > 1:
        columns.insert(1, ("noise", True))
    if len(methods_of(answers)) > 1:
        columns.insert(1, ("method", False))
    return columns


def _row(number: int, one: EvaluatedPair, columns: list[tuple[str, bool]]) -> dict[str, Any]:
    cells = _cells(one)
    return {
        "number": number,
        "anchor": _anchor(one),
        "outcome": one.outcome or NOT_MERGED,
        "method": one.method,
        "world": one.pair.world or "",
        "level": _level(one),
        "words": " ".join(
            (one.pair.title, one.method, one.pair.world or "", one.outcome or NOT_MERGED, one.reason or "")
        ).lower(),
        "reason": one.reason or "",
        "cells": [cells[name] for name, _ in columns],
    }


def _anchor(one: EvaluatedPair) -> str:
    """Name a pair in links: the same in every report on the same answers."""
    words = " ".join(("pair", one.pair.title, *one.pair.level, one.method))
    return re.sub(r"[^A-Za-z0-9_.]+", "-", words).strip("-")


def _cells(one: EvaluatedPair) -> dict[str, tuple[str, str]]:
    """Format each column, and give the key that it is sorted by."""
    level, world, overlap = _level(one), one.pair.world, one.truth.overlap
    error, true = one.error, one.truth.target_from_source
    return {
        "pair": (one.pair.title, one.pair.title),
        "method": (one.method, one.method),
        "level": (level, level),
        "noise": (level, level),
        "world": (world or "-", world or ""),
        "outcome": (one.outcome or NOT_MERGED, str(outcome_rank(one))),
        "confidence": _number(one.confidence, 2),
        "displacement [m]": _number(None if error is None else error.displacement_m, 3),
        "rotation [deg]": _number(None if error is None else error.rotation_deg, 2),
        "scale [%]": _number(None if error is None else error.scale_percent, 2),
        "overlap [%]": _number(None if overlap is None else 100.0 * overlap, 0),
        "time [s]": _number(one.seconds, 2),
        "one right answer": ("none" if one.negative else "yes" if one.identifiable else "several",) * 2,
        "residual [m]": _number(one.truth.residual_m, 3),
        "true yaw [deg]": _number(None if true is None else math.degrees(true.yaw), 1),
        "true scale": _number(None if true is None else true.scale, 3),
    }


def _number(value: float | None, places: int) -> tuple[str, str]:
    return ("-", "") if value is None else (f"{value:.{places}f}", repr(float(value)))


def _filters(answers: tuple[EvaluatedPair, ...]) -> list[tuple[str, str, list[str]]]:
    """List name, label and values of each filter that separates rows."""
    levels = dict.fromkeys(_level(one) for one in answers)
    named = "level" if any(one.pair.level for one in answers) else "noise level"
    found_outcomes = {one.outcome or NOT_MERGED for one in answers}
    outcomes = [name for name in (*OUTCOMES, NOT_MERGED) if name in found_outcomes]
    found: list[tuple[str, str, list[str]]] = [
        ("outcome", "outcome", outcomes),
        ("method", "method", list(methods_of(answers))),
        ("level", named, [level for level in levels if level]),
        ("world", "world", sorted({one.pair.world for one in answers if one.pair.world})),
    ]
    return [(name, label, values) for name, label, values in found if len(values) > 1]


def _facts(one: EvaluatedPair) -> dict[str, Any]:
    """List the facts that stand beside the pictures of a pair."""
    evidence, overlap = one.evidence, one.truth.overlap
    unique = "yes" if one.identifiable else "no, several placements fit"
    facts = {
        "outcome": NOT_MERGED if one.outcome is None else outcome_text(one),
        "reason of the refusal": one.reason,
        "confidence": _text(one.confidence, 2),
        "error": _error(one),
        "true overlap": None if overlap is None else f"{100 * overlap:.0f} %",
        "alignment score": _text(None if evidence is None else evidence.score, 3),
        "second-best score": _text((None if evidence is None else evidence.second_best_score) or None, 3),
        "distorted": _distortion(one),
        "one right answer": None if one.negative else unique,
        "level": " ".join(one.pair.level) or None,
        "noise level": None if one.pair.noise is None else f"{one.pair.noise:g}",
        "world": one.pair.world,
        "processor time": None if one.seconds is None else f"{one.seconds:.2f} s",
    }
    return {
        "title": one.pair.title,
        "method": one.method,
        "outcome": one.outcome or NOT_MERGED,
        "negative": one.negative,
        "facts": [(name, value) for name, value in facts.items() if value],
    }


def _distortion(one: EvaluatedPair) -> str | None:
    """Say how far the two maps differ in shape, whatever bent them: drift, odometry, or noise at true poses."""
    if not one.distorted or one.truth.residual_m is None:
        return None
    return f"the maps differ in shape: at the best transform, common walls lie {one.truth.residual_m:.2f} m apart (RMS)"


def _level(one: EvaluatedPair) -> str:
    return " ".join(one.pair.level) or ("" if one.pair.noise is None else f"{one.pair.noise:g}")


def _text(value: float | None, places: int) -> str | None:
    return None if value is None else f"{value:.{places}f}"


def _error(one: EvaluatedPair) -> str | None:
    error = one.error
    if error is None:
        return None
    moved = "no common cells"
    if error.displacement_m is not None:
        moved = f"{error.displacement_m:.3f} m ({error.displacement_cells:.1f} cells)"
    return f"{moved}, {error.rotation_deg:.2f} degrees, {error.scale_percent:.2f} % of scale"
