"""Bounds of the scale of an answer."""

from __future__ import annotations

import math
from dataclasses import dataclass


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
    def parse(text: str) -> ScaleRange:
        """Parse ``known``, ``free`` or ``LO:HI``. Raises ``ValueError`` naming the text."""
        if text in ("known", "free"):
            return ScaleRange.known() if text == "known" else ScaleRange.free()
        low, _, high = text.partition(":")
        try:
            bounds = float(low), float(high)
        except ValueError:
            raise ValueError(f"scale is {text!r}, must be known, free or LO:HI such as 0.5:2") from None
        try:
            return ScaleRange(*bounds)
        except ValueError as error:
            raise ValueError(f"scale is {text!r}: {error}") from None

    @property
    def fixed(self) -> bool:
        return self.low == self.high

    @property
    def middle(self) -> float:
        """The geometric mean, which is the stated scale if the range extends equally below and above it."""
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
