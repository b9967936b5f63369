"""Bounds of the scale of an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapping.numbers import parse_range

WIDEST = 20.0
"""Scales are searched from its inverse up to it."""


@dataclass(frozen=True)
class ScaleRange:
    """The scales that an answer may have, ``low`` to ``high``; equal if the scale is known.

    Bounds are stated metres of the target per stated metre of the source, or pixels per pixel if either map is a bare
    picture.

    Raises ``ValueError`` if a bound is not positive and finite, or ``low`` is above ``high``.
    """

    low: float = 1.0
    high: float = 1.0

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            value = float(getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"ScaleRange: {name} is {value}, must be positive and finite")
            object.__setattr__(self, name, value)
        if self.low > self.high:
            raise ValueError(f"ScaleRange: low is {self.low}, must be at most high, {self.high}")

    @staticmethod
    def known() -> ScaleRange:
        return ScaleRange(1.0, 1.0)

    @staticmethod
    def free() -> ScaleRange:
        return ScaleRange(0.5, 2.0)

    @staticmethod
    def widest() -> ScaleRange:
        """Return the widest range that can be searched."""
        return ScaleRange(1.0 / WIDEST, WIDEST)

    @staticmethod
    def parse(text: str) -> ScaleRange | None:
        """Parse the scales that an answer may have: known, free (0.5 to 2), LO:HI, or auto: None, the maps decide.

        Raises ``ValueError`` naming the text.
        """
        if text in ("auto", "known", "free"):
            return {"auto": None, "known": ScaleRange.known(), "free": ScaleRange.free()}[text]
        try:
            low, high = parse_range(text)
        except ValueError:
            raise ValueError(f"scale is {text}, must be auto, known, free or LO:HI such as 0.5:2") from None
        if not 1.0 / WIDEST <= low <= high <= WIDEST:
            raise ValueError(f"scale is {text}, must be LO:HI with {1.0 / WIDEST:g} <= LO <= HI <= {WIDEST:g}")
        return ScaleRange(low, high)

    @property
    def fixed(self) -> bool:
        return self.low == self.high

    @property
    def middle(self) -> float:
        """Geometric mean of the bounds: the stated scale if the range is symmetric about it."""
        return math.sqrt(self.low * self.high)

    def times(self, factor: float) -> ScaleRange:
        """Convert the range to other units."""
        return ScaleRange(self.low * factor, self.high * factor)

    def inverse(self) -> ScaleRange:
        """Return the range of the inverse transforms."""
        return ScaleRange(1.0 / self.high, 1.0 / self.low)

    def clip(self, scale: float) -> float:
        """Return the nearest scale within the range."""
        return min(max(scale, self.low), self.high)
