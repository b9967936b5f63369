"""Define the drives of a robot and its limits of speed and acceleration."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

Drive = Literal["velocity", "wheels"]
"""velocity: set the planar velocity of the body; wheels: a differential drive whose two wheels can slip."""

DRIVES: tuple[str, ...] = get_args(Drive)


LARGEST_LIMIT = 100.0
"""Upper bound of every limit, in its own unit."""


@dataclass(frozen=True)
class DriveLimits:
    """Limit forward ``speed`` [m/s], ``turn_rate`` [rad/s], ``acceleration`` [m/s^2] and ``turn_acceleration``
    [rad/s^2]. Backwards, a robot drives at most at a quarter of ``speed``.

    Raises ``ValueError`` with the field and its value.
    """

    speed: float = 0.6
    turn_rate: float = 1.5
    acceleration: float = 1.5
    turn_acceleration: float = 6.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 < value <= LARGEST_LIMIT:
                raise ValueError(f"DriveLimits: {each.name} is {value}, must be positive and at most {LARGEST_LIMIT:g}")

    def ramp(self, now: tuple[float, float], target: tuple[float, float], seconds: float) -> tuple[float, float]:
        """Return the (forward speed, turn rate) reached from ``now`` towards ``target`` after ``seconds``."""
        speed, turn_rate = self.acceleration * seconds, self.turn_acceleration * seconds
        return (
            now[0] + max(-speed, min(speed, target[0] - now[0])),
            now[1] + max(-turn_rate, min(turn_rate, target[1] - now[1])),
        )
