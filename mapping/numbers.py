"""Numbers as people write them: Python's own reading takes 1_0, nan and infinity as well."""

from __future__ import annotations

import math
import re

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def parse_number(text: str) -> float:
    """Parse a finite number. Raises ``ValueError`` naming the text."""
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise ValueError(f"{text!r} is no number")
    return float(text)


def parse_range(text: str) -> tuple[float, float]:
    """Parse LO:HI into two numbers. Raises ``ValueError`` naming the text."""
    low, _, high = text.partition(":")
    return parse_number(low), parse_number(high)


def parse_angle(text: str) -> float:
    """Parse an angle [rad], or one in degrees that ends with ``deg``. Raises ``ValueError`` naming the text."""
    if text.endswith("deg"):
        return math.remainder(math.radians(parse_number(text.removesuffix("deg"))), math.tau)
    return parse_number(text)
