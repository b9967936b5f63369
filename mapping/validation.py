"""Validation of settings."""

from __future__ import annotations

import dataclasses
import math
from typing import Any


def require_valid(
    settings: Any, *, not_negative: tuple[str, ...] = (), shares: tuple[str, ...] = (), signed: tuple[str, ...] = ()
) -> None:
    """Check the numbers of a settings dataclass: all must be finite, and whole if the field is an ``int``.

    They must be positive, but for the fields ``not_negative``, ``shares`` (0 to 1) and ``signed``. A tuple holds at
    least one number, and the rule of its field applies to each.

    Raises ``ValueError`` that names the class, the field and the value.
    """
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        name = f"{type(settings).__name__}: {field.name}"
        if value == ():
            raise ValueError(f"{name} is empty, must hold at least one number")
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, bool) or not isinstance(number, int | float):
                continue
            if not math.isfinite(number):
                raise ValueError(f"{name} is {number}, must be finite")
            if field.type == "int" and not isinstance(number, int):
                raise ValueError(f"{name} is {number}, must be a whole number")
            if field.name in shares:
                if not 0.0 <= number <= 1.0:
                    raise ValueError(f"{name} is {number}, must lie between 0 and 1")
            elif field.name in not_negative:
                if number < 0.0:
                    raise ValueError(f"{name} is {number}, must not be negative")
            elif field.name not in signed and not number > 0.0:
                raise ValueError(f"{name} is {number}, must be positive")


def require_ordered(settings: Any, *names: str) -> None:
    """Check that fields of two numbers, low and high, are in order. Raises ``ValueError`` as ``require_valid`` does."""
    for name in names:
        low, high = getattr(settings, name)
        if low > high:
            raise ValueError(f"{type(settings).__name__}: {name} is {low:g}:{high:g}, must be in order")
