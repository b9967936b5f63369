"""How fast a robot may drive."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class DriveLimits:
    """Greatest forward ``speed`` [m/s] and ``turn_rate`` [rad/s]; backwards a robot goes at a quarter of the speed.

    Raises ``ValueError`` naming the field and its value.
    """

    speed: float = 0.6
    turn_rate: float = 1.5

    def __post_init__(self) -> None:
        for name in ("speed", "turn_rate"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"DriveLimits: {name} is {value}, must be positive and finite")
