"""Pictures of the pairs that a report draws, each stored once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mapquilt.evaluation.evaluated_pair import EvaluatedPair
from mapquilt.report.content import outcome_rank
from mapquilt.report.pictures import Painter

Progress = Callable[[int, int], None]


@dataclass
class Gallery:
    """``images`` are data addresses; ``shown`` has, for each drawn answer, the indices of its pictures."""

    images: list[str] = field(default_factory=list)
    shown: dict[int, dict[str, int | None]] = field(default_factory=dict)
    _places: dict[str, int] = field(default_factory=dict)
    _painter: Painter = field(default_factory=Painter)

    def add(self, number: int, answer: EvaluatedPair) -> None:
        drawn = self._painter.draw(answer)
        self.shown[number] = {
            "target": self._place(drawn.target),
            "source": self._place(drawn.source),
            "answer": self._place(drawn.by_answer),
            "truth": self._place(drawn.by_truth),
            "alternative": self._place(drawn.by_alternative),
        }

    def _place(self, address: str | None) -> int | None:
        if address is None:
            return None
        if address not in self._places:
            self._places[address] = len(self.images)
            self.images.append(address)
        return self._places[address]


def draw_gallery(answers: Sequence[EvaluatedPair], most: int, on_progress: Progress) -> Gallery:
    """Draw at most ``most`` answers. Raises ``ValueError`` or ``OSError`` naming a map file that cannot be read."""
    gallery = Gallery()
    chosen = choose(answers, most)
    for done, number in enumerate(chosen, start=1):
        gallery.add(number, answers[number])
        on_progress(done, len(chosen))
    return gallery


def choose(answers: Sequence[EvaluatedPair], most: int) -> list[int]:
    """Choose the indices of the answers to draw: half of them errors, false accepts first, the others evenly spread."""
    order = sorted(range(len(answers)), key=lambda k: (outcome_rank(answers[k]), -(answers[k].confidence or 0.0), k))
    if len(order) <= most:
        return order
    errors = [k for k in order if answers[k].outcome in ("false accept", "false reject")]
    first = errors[: max(most // 2, most - (len(order) - len(errors)))]
    rest = [k for k in range(len(answers)) if k not in set(first)]
    steps = np.floor(np.arange(most - len(first)) * len(rest) / max(1, most - len(first))).astype(int)
    return [*first, *(rest[step] for step in steps.tolist())]
