"""Which pairs are drawn, and their pictures, each held once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mapquilt.report.answer import OUTCOMES, ReportAnswer
from mapquilt.report.pictures import Painter

Progress = Callable[[int, int], None]


@dataclass
class Gallery:
    """``images`` are data addresses; ``shown`` says of each drawn answer which of them are its pictures."""

    images: list[str] = field(default_factory=list)
    shown: dict[int, dict[str, int | None]] = field(default_factory=dict)
    _places: dict[str, int] = field(default_factory=dict)
    _painter: Painter = field(default_factory=Painter)

    def add(self, number: int, answer: ReportAnswer) -> None:
        drawn = self._painter.draw(answer)
        self.shown[number] = {
            "target": self._place(drawn.target),
            "source": self._place(drawn.source),
            "answer": self._place(drawn.by_answer),
            "truth": self._place(drawn.by_truth),
            "runner_up": self._place(drawn.by_runner_up),
        }

    def _place(self, address: str | None) -> int | None:
        if address is None:
            return None
        if address not in self._places:
            self._places[address] = len(self.images)
            self.images.append(address)
        return self._places[address]


def draw_gallery(answers: Sequence[ReportAnswer], most: int, on_progress: Progress) -> Gallery:
    """Draw at most so many answers. Raises ``ValueError`` or ``OSError`` naming a map file that cannot be read."""
    gallery = Gallery()
    chosen = choose(answers, most)
    for done, number in enumerate(chosen, start=1):
        gallery.add(number, answers[number])
        on_progress(done, len(chosen))
    return gallery


def choose(answers: Sequence[ReportAnswer], most: int) -> list[int]:
    """Numbers of the answers to draw: half of them what was wrong, then missed; the others evenly from the rest."""
    order = sorted(
        range(len(answers)), key=lambda k: (OUTCOMES.index(answers[k].outcome), -(answers[k].confidence or 0.0), k)
    )
    if len(order) <= most:
        return order
    troubled = [k for k in order if answers[k].outcome in ("wrong", "missed")]
    first = troubled[: max(most // 2, most - (len(order) - len(troubled)))]
    rest = [k for k in range(len(answers)) if k not in set(first)]
    steps = np.floor(np.arange(most - len(first)) * len(rest) / max(1, most - len(first))).astype(int)
    return [*first, *(rest[step] for step in steps.tolist())]
