"""Answers of the reproduction, counted by trial and method."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist, median

from mapquilt.evaluation.statistics import LEVEL, Interval
from reproductions.chen2021.answers import Answer

Z = NormalDist().inv_cdf((1.0 + LEVEL) / 2.0)


@dataclass(frozen=True)
class Tally:
    """One method on the maps of one trial.

    ``right`` of ``runs`` on ``maps`` pairs of maps; ``false_accepts``: accepted and wrong. The indices are medians of
    the runs, the error of the right ones; None if there are none.
    """

    right: int
    runs: int
    maps: int
    false_accepts: int
    index: float | None
    index_of_greys: float | None
    error_cells: float | None

    @staticmethod
    def of(answers: Sequence[Answer]) -> Tally:
        right = [one for one in answers if one.right]
        return Tally(
            right=len(right),
            runs=len(answers),
            maps=len({one.seed for one in answers}),
            false_accepts=sum(one.accepted and not one.right for one in answers),
            index=_median([one.index for one in answers]),
            index_of_greys=_median([one.index_of_greys for one in answers]),
            error_cells=_median([one.displacement_cells for one in right]),
        )

    @property
    def share(self) -> float:
        return self.right / self.runs

    @property
    def interval(self) -> Interval:
        """Return Wilson's interval of the share; runs on the same maps are not independent, so maps are counted."""
        return wilson(self.share, self.maps)


Tallies = Mapping[tuple[str, str], Tally]
"""By trial and method."""


def tallies(answers: Sequence[Answer]) -> dict[tuple[str, str], Tally]:
    """Count the answers of each trial and method, in their order."""
    groups = defaultdict[tuple[str, str], list[Answer]](list)
    for one in answers:
        groups[one.trial, one.method].append(one)
    return {names: Tally.of(group) for names, group in groups.items()}


def wilson(share: float, of: int) -> Interval:
    """Compute the 95 % interval of any share, not only a count, of ``of`` independent trials (Wilson 1927)."""
    middle = (share + Z**2 / (2 * of)) / (1.0 + Z**2 / of)
    reach = Z / (1.0 + Z**2 / of) * math.sqrt(share * (1.0 - share) / of + Z**2 / (4 * of**2))
    return Interval(max(0.0, middle - reach), min(1.0, middle + reach))


def _median(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return median(known) if known else None
