"""Sheets with pictures of every answer of a method, errors first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from mapping.io.map_file import load_map
from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair
from mapquilt.viz.pair_card import TRUE_PLACE, card_picture
from mapquilt.viz.palette import INK, OUTCOME_COLOURS, ROBOTS
from mapquilt.viz.png import default_style, figure_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS, ROWS = 2, 6
CARD_INCHES = (7.6, 3.0)
HEADER_INCHES = 0.9
DPI = 100
LEGEND = (
    (0.52, "target", ROBOTS[0]),
    (0.59, "source as answered", ROBOTS[1]),
    (0.72, "both", INK),
    (0.78, "dashed: true place of the source", TRUE_PLACE),
)
LONGEST_NAME, LONGEST_FACTS = 62, 112


def most_relevant_first(answers: Iterable[EvaluatedPair]) -> dict[str, list[int]]:
    """Sort the numbers of each method's answers by outcome, false accepts first; then wrong answers before right ones,
    and high confidence before low."""
    ranks: dict[str, list[tuple[int, bool, float, int]]] = {}
    for number, one in enumerate(answers):
        if one.outcome is not None:
            rank = (OUTCOMES.index(one.outcome), one.right, -(one.confidence or 0.0), number)
            ranks.setdefault(one.method, []).append(rank)
    return {method: [rank[-1] for rank in sorted(found)] for method, found in ranks.items()}


def sheet_pages(answers: Sequence[EvaluatedPair], shown: Sequence[int]) -> Iterator[bytes]:
    """Draw the answers of these numbers, in this order, as PNG pages; they are read page by page."""
    size = COLUMNS * ROWS
    pages = math.ceil(len(shown) / size)
    for page in range(pages):
        drawn = [answers[number] for number in shown[page * size : (page + 1) * size]]
        yield figure_png(_page(drawn, f"page {page + 1} of {pages}"))


@default_style()
def _page(pairs: Sequence[EvaluatedPair], page: str) -> Figure:
    from matplotlib.figure import Figure

    rows = math.ceil(len(pairs) / COLUMNS)
    height = rows * CARD_INCHES[1] + HEADER_INCHES
    figure = Figure(figsize=(COLUMNS * CARD_INCHES[0], height), dpi=DPI, facecolor="white")
    _header(figure, f"{pairs[0].method}, {page}", height)
    for index, one in enumerate(pairs):
        row, column = divmod(index, COLUMNS)
        bottom = (height - HEADER_INCHES - (row + 1) * CARD_INCHES[1]) / height
        box = (column / COLUMNS + 0.012, bottom + 0.012, 1 / COLUMNS - 0.024, 0.79 * CARD_INCHES[1] / height)
        _draw_card(figure.add_axes(box), one)
    return figure


def _header(figure: Figure, title: str, height: float) -> None:
    top = 1.0 - 0.3 / height
    figure.text(0.012, top, title, fontsize=15, color=INK, va="center", weight="bold")
    for place, words, colour in LEGEND:
        figure.text(place, top, f"■ {words}", fontsize=10, color=colour, va="center")
    words = "target, source, and the source over the target; false accepts and false rejects first"
    figure.text(0.012, 1.0 - 0.62 / height, words, fontsize=10, color=INK, va="center")


def _draw_card(axes: Axes, one: EvaluatedPair) -> None:
    target, source = (load_map(file).grid for file in (one.pair.target_file, one.pair.source_file) if file is not None)
    image = card_picture(target, source, one.answer, one.truth.target_from_source)
    axes.imshow(image, interpolation="antialiased", aspect="auto")
    axes.set_xticks([])
    axes.set_yticks([])
    outcome = one.outcome or ""
    colour = OUTCOME_COLOURS[outcome]
    for spine in axes.spines.values():
        spine.set_color(colour)
        spine.set_linewidth(1.8)
    words = f"{outcome}, the answer is {'right' if one.right else 'wrong'}" if outcome == "false reject" else outcome
    axes.text(0.0, 1.125, words, transform=axes.transAxes, fontsize=10, color=colour, weight="bold")
    name = _shortened(one.pair.title, LONGEST_NAME)
    axes.text(1.0, 1.125, name, transform=axes.transAxes, fontsize=9, color=INK, ha="right")
    axes.text(0.0, 1.03, _facts(one), transform=axes.transAxes, fontsize=9, color=INK)


def _facts(one: EvaluatedPair) -> str:
    facts = [f"confidence {one.confidence:.2f}"]
    if one.negative:
        facts.append("no common ground")
    elif one.truth.overlap is not None:
        facts.append(f"overlap {100 * one.truth.overlap:.0f} %")
    if not one.negative and not one.identifiable:
        facts.append("not identifiable")
    if not one.reliable:
        facts.append("distorted")
    error = one.error
    if error is not None and error.displacement_cells is not None:
        moved = f"{error.rotation_deg:.2f} deg, {error.scale_percent:.2f} %, {error.displacement_cells:.1f} cells"
        facts.append(f"error {moved}")
    if one.reason is not None:
        facts.append(one.reason)
    return _shortened("; ".join(facts), LONGEST_FACTS)


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
