"""Every pair of a benchmark as pictures, page by page, the wrong and the refused ones first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mapquilt.benchmark.trial import Answer, Trial
from mapquilt.viz.pair_card import TRUE_PLACE, card_picture
from mapquilt.viz.palette import INK, ROBOTS
from mapquilt.viz.png import figure_png

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
    (0.78, "dashed: the true place of the source", TRUE_PLACE),
)
LONGEST_NAME, LONGEST_FACTS = 62, 112


@dataclass(frozen=True)
class Outcome:
    """How an answer turned out: shown in this order, words and colour."""

    order: int
    words: str
    colour: str


WRONG_ACCEPT = Outcome(0, "wrong, and accepted", "#c1121f")
FALSE_ACCEPT = Outcome(0, "to be refused, and accepted", "#c1121f")
WRONG = Outcome(1, "wrong, refused", "#D55E00")
RIGHT_REFUSED = Outcome(2, "right, but refused", "#B8860B")
RIGHT = Outcome(3, "right, accepted", "#007a5a")
REFUSED = Outcome(4, "to be refused, refused", "#5b6470")
RIGHTLY_REFUSED = Outcome(4, "not identifiable, refused", "#5b6470")


def outcome(trial: Trial, answer: Answer) -> Outcome:
    """How the answer turned out."""
    if trial.negative:
        return FALSE_ACCEPT if answer.accepted else REFUSED
    if not trial.pair.identifiable and not answer.accepted:
        return RIGHTLY_REFUSED
    if answer.right:
        return RIGHT if answer.accepted else RIGHT_REFUSED
    return WRONG_ACCEPT if answer.accepted else WRONG


def in_order(trials: Sequence[Trial], method: int) -> list[Trial]:
    """Wrong accepts first, then what is wrong, then what was refused though right; the surer the answer, the sooner."""
    return sorted(
        trials,
        key=lambda trial: (outcome(trial, trial.answers[method]).order, -trial.answers[method].confidence),
    )


def sheet_pages(trials: Sequence[Trial], method: int) -> Iterator[bytes]:
    """PNG pages of the method at this place in the trials' order."""
    shown = in_order(trials, method)
    size = COLUMNS * ROWS
    pages = math.ceil(len(shown) / size)
    for page in range(pages):
        part = shown[page * size : (page + 1) * size]
        yield figure_png(_page(part, method, f"page {page + 1} of {pages}"))


def _page(trials: Sequence[Trial], method: int, where: str) -> Figure:
    from matplotlib.figure import Figure

    rows = math.ceil(len(trials) / COLUMNS)
    height = rows * CARD_INCHES[1] + HEADER_INCHES
    figure = Figure(figsize=(COLUMNS * CARD_INCHES[0], height), dpi=DPI, facecolor="white")
    _header(figure, trials[0].answers[method].method, where, height)
    for index, trial in enumerate(trials):
        row, column = divmod(index, COLUMNS)
        bottom = (height - HEADER_INCHES - (row + 1) * CARD_INCHES[1]) / height
        box = (column / COLUMNS + 0.012, bottom + 0.012, 1 / COLUMNS - 0.024, 0.79 * CARD_INCHES[1] / height)
        _draw_card(figure.add_axes(box), trial, trial.answers[method])
    return figure


def _header(figure: Figure, method: str, where: str, height: float) -> None:
    top = 1.0 - 0.3 / height
    figure.text(0.012, top, f"{method}, {where}", fontsize=15, color=INK, va="center", weight="bold")
    for place, words, colour in LEGEND:
        figure.text(place, top, f"■ {words}", fontsize=10, color=colour, va="center")
    words = "target, source, and the source laid on the target; wrong and refused answers first"
    figure.text(0.012, 1.0 - 0.62 / height, words, fontsize=10, color=INK, va="center")


def _draw_card(axes: Axes, trial: Trial, answer: Answer) -> None:
    maps = trial.pair.maps()
    truth = trial.pair.target_from_source(maps)
    axes.imshow(card_picture(maps, answer.target_from_source, truth), interpolation="antialiased", aspect="auto")
    axes.set_xticks([])
    axes.set_yticks([])
    found = outcome(trial, answer)
    for spine in axes.spines.values():
        spine.set_color(found.colour)
        spine.set_linewidth(1.8)
    axes.text(0.0, 1.125, found.words, transform=axes.transAxes, fontsize=10, color=found.colour, weight="bold")
    name = _shortened(f"{trial.pair.suite}: {trial.pair.name}", LONGEST_NAME)
    axes.text(1.0, 1.125, name, transform=axes.transAxes, fontsize=9, color=INK, ha="right")
    axes.text(0.0, 1.03, _facts(trial, answer), transform=axes.transAxes, fontsize=9, color=INK)


def _facts(trial: Trial, answer: Answer) -> str:
    facts = [f"confidence {answer.confidence:.2f}"]
    if trial.pair.overlap is not None and not trial.negative:
        facts.append(f"overlap {100 * trial.pair.overlap:.0f} %")
    if not trial.negative and not trial.pair.identifiable:
        facts.append("not identifiable")
    if trial.bent:
        facts.append("bent")
    error = answer.error
    if error is not None and error.displacement_cells is not None:
        moved = f"{error.rotation_deg:.2f} deg, {error.scale_percent:.2f} %, {error.displacement_cells:.1f} cells"
        facts.append(f"off by {moved}")
    if answer.reason is not None:
        facts.append(answer.reason)
    return _shortened("; ".join(facts), LONGEST_FACTS)


def _shortened(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"
