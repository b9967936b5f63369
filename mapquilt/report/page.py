"""The page: everything in one file."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import Any

import jinja2

from mapquilt.report.answer import OUTCOME_WORDS, OUTCOMES, ReportAnswer, methods_of
from mapquilt.report.charts import common_charts
from mapquilt.report.content import Chart, Content
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

WIDE = 6.5
"""A figure of more inches takes the page's whole width."""


def render_page(content: Content, pictures: int, on_progress: Progress = lambda done, total: None) -> str:
    """HTML that needs nothing beside it. At most ``pictures`` answers are drawn, what went wrong first.

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
        pictures=[(one, png_address(one.png)) for one in content.pictures],
        sheets=[*([] if sheet is None else [sheet]), *content.sheets],
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


def _thumb(places: dict[str, int | None]) -> int | None:
    """What stands for a pair in the table: the merge, else the truth, else its target."""
    return next((places[name] for name in ("answer", "truth", "target") if places[name] is not None), None)


def _json(value: Any) -> str:
    """JSON that may stand in a script: no tag can end it."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False).replace("<", "\\u003c")


def _columns(answers: tuple[ReportAnswer, ...]) -> list[tuple[str, bool]]:
    columns = list(COLUMNS)
    if not any(one.seconds is not None for one in answers):
        columns.remove(("time [s]", True))
    if len({one.world for one in answers}) > 1:
        columns.insert(1, ("world", False))
    if any(one.level for one in answers):
        columns.insert(1, ("level", True))
    elif len({one.noise for one in answers}) > 1:
        columns.insert(1, ("noise", True))
    if len(methods_of(answers)) > 1:
        columns.insert(1, ("method", False))
    return columns


def _row(number: int, one: ReportAnswer, columns: list[tuple[str, bool]]) -> dict[str, Any]:
    cells = _cells(one)
    return {
        "number": number,
        "outcome": one.outcome,
        "method": one.method,
        "world": one.world or "",
        "level": one.level or ("" if one.noise is None else f"{one.noise:g}"),
        "words": " ".join((one.pair, one.method, one.world or "", one.outcome, one.reason or "")).lower(),
        "reason": one.reason or "",
        "cells": [cells[name] for name, _ in columns],
    }


def _cells(one: ReportAnswer) -> dict[str, tuple[str, str]]:
    """Of each column the text, and what it is sorted by."""
    level = one.level or ("" if one.noise is None else f"{one.noise:g}")
    return {
        "pair": (one.pair, one.pair),
        "method": (one.method, one.method),
        "level": (level, level),
        "noise": (level, level),
        "world": (one.world or "-", one.world or ""),
        "outcome": (one.outcome, str(OUTCOMES.index(one.outcome))),
        "confidence": _number(one.confidence, 2),
        "displacement [m]": _number(one.displacement_m, 3),
        "rotation [deg]": _number(one.rotation_deg, 2),
        "scale [%]": _number(one.scale_percent, 2),
        "overlap [%]": _number(None if one.overlap is None else 100.0 * one.overlap, 0),
        "time [s]": _number(one.seconds, 2),
    }


def _number(value: float | None, places: int) -> tuple[str, str]:
    return ("-", "") if value is None else (f"{value:.{places}f}", repr(float(value)))


def _filters(answers: tuple[ReportAnswer, ...]) -> list[tuple[str, str, list[str]]]:
    """Name, label and values of what rows can be chosen by; of those alone that tell rows apart."""
    levels = dict.fromkeys(one.level or ("" if one.noise is None else f"{one.noise:g}") for one in answers)
    named = "level" if any(one.level for one in answers) else "noise level"
    outcomes = [name for name in OUTCOMES if any(one.outcome == name for one in answers)]
    found: list[tuple[str, str, list[str]]] = [
        ("outcome", "outcome", list(outcomes)),
        ("method", "method", list(methods_of(answers))),
        ("level", named, [level for level in levels if level]),
        ("world", "world", sorted({one.world for one in answers if one.world})),
    ]
    return [(name, label, values) for name, label, values in found if len(values) > 1]


def _facts(one: ReportAnswer) -> dict[str, Any]:
    """What stands beside the pictures of a pair."""
    told = {
        "outcome": OUTCOME_WORDS[one.outcome],
        "reason of the refusal": one.reason,
        "confidence": _told(one.confidence, 2),
        "off by": _off(one),
        "true overlap": None if one.overlap is None else f"{100 * one.overlap:.0f} %",
        "walls agree": _told(one.score, 3),
        "runner-up": None if one.runner_up_score is None else f"walls agree {one.runner_up_score:.3f}",
        "bent": "drift leaves no transform that fits" if one.bent else None,
        "one right answer": None if one.negative else "yes" if one.identifiable else "no, it fits in more than one way",
        "level": one.level or None,
        "noise level": None if one.noise is None else f"{one.noise:g}",
        "world": one.world,
        "processor time": None if one.seconds is None else f"{one.seconds:.2f} s",
    }
    return {
        "title": one.pair,
        "method": one.method,
        "outcome": one.outcome,
        "negative": one.negative,
        "facts": [(name, value) for name, value in told.items() if value],
    }


def _told(value: float | None, places: int) -> str | None:
    return None if value is None else f"{value:.{places}f}"


def _off(one: ReportAnswer) -> str | None:
    if one.rotation_deg is None or one.negative:
        return None
    moved = "no common cells"
    if one.displacement_m is not None and one.displacement_cells is not None:
        moved = f"{one.displacement_m:.3f} m ({one.displacement_cells:.1f} cells)"
    return f"{moved}, {one.rotation_deg:.2f} degrees, {one.scale_percent:.2f} % of scale"
