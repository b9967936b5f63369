"""How a robot drives, and how fast it may."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

Drive = Literal["velocity", "wheels"]
"""velocity: a body whose planar velocity is commanded; wheels: a differential drive on two driven wheels that slip."""

DRIVES: tuple[str, ...] = get_args(Drive)


LARGEST = 100.0
"""No robot is faster, in whatever unit."""


@dataclass(frozen=True)
class DriveLimits:
    """Greatest forward ``speed`` [m/s], ``turn_rate`` [rad/s], ``acceleration`` [m/s^2] and ``turn_acceleration``
    [rad/s^2]; backwards a robot goes at a quarter of the speed.

    Raises ``ValueError`` naming the field and its value.
    """

    speed: float = 0.6
    turn_rate: float = 1.5
    acceleration: float = 1.5
    turn_acceleration: float = 6.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 < value <= LARGEST:
                raise ValueError(f"DriveLimits: {each.name} is {value}, must be positive and at most {LARGEST:g}")

    def ramped(self, now: tuple[float, float], wanted: tuple[float, float], seconds: float) -> tuple[float, float]:
        """The (forward speed, turn rate) that a robot of those ``now`` reaches towards those wanted in that time."""
        speed, turn_rate = self.acceleration * seconds, self.turn_acceleration * seconds
        return (
            now[0] + max(-speed, min(speed, wanted[0] - now[0])),
            now[1] + max(-turn_rate, min(turn_rate, wanted[1] - now[1])),
        )
