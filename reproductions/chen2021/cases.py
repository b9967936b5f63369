"""Cases of chapters 3, 5 and 6 of the thesis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Place = Literal["hall", "floor"]
PLACES: tuple[Place, ...] = ("hall", "floor")

RESOLUTION, RANGE_SIGMA = 0.05, 0.005
"""Default cell size and range noise [m]."""

BASE = "base"


@dataclass(frozen=True)
class HallMap:
    """A map of the hall: index of its start, cell size and range noise [m]."""

    start: int
    resolution: float = RESOLUTION
    range_sigma: float = RANGE_SIGMA


SET_1_START, OTHER_START = 3, 4
"""Starts at 2 and 3 rad: set 1 differs from the base map by 245 degrees, sets 2 and 3 by 188."""

HALL_MAPS = {
    BASE: HallMap(0),
    "set 1": HallMap(SET_1_START),
    "set 2": HallMap(OTHER_START, resolution=0.1),
    "set 3": HallMap(OTHER_START, range_sigma=0.1),
    "noise 0.05 m": HallMap(OTHER_START, range_sigma=0.05),
    "noise 0.5 m": HallMap(OTHER_START, range_sigma=0.5),
    "0.025 m cells": HallMap(OTHER_START, resolution=0.025),
    "0.2 m cells": HallMap(OTHER_START, resolution=0.2),
}
"""Maps by the case in which they are merged with the base map."""

FLOOR_MAPS = ("robot 1", "robot 2", "robot 3")
"""Names of the robots in the floor's left, right and lower corridor."""


@dataclass(frozen=True)
class Measured:
    """Results of the thesis for one case: right runs of the existing pipeline, ``plain`` of ``plain_runs``, and its
    acceptance index; the same for the corrected pipeline, None if it was not run; and the index at the truth."""

    plain: int
    plain_index: float
    corrected: int | None
    true_index: float
    plain_runs: int = 20
    corrected_runs: int = 5

    @property
    def plain_text(self) -> str:
        return f"{self.plain} of {self.plain_runs}"

    @property
    def corrected_text(self) -> str:
        return "not run" if self.corrected is None else f"{self.corrected} of {self.corrected_runs}"


@dataclass(frozen=True)
class Case:
    """``maps`` by name, target first; more than two are a team. ``measured`` is the thesis's, None if not measured."""

    name: str
    place: Place
    maps: tuple[str, ...]
    differs: str
    measured: Measured | None = None

    @property
    def title(self) -> str:
        return self.name if self.differs == self.name else f"{self.name}: {self.differs}"

    @property
    def team(self) -> bool:
        return len(self.maps) > 2


CASES = (
    Case("set 1", "hall", (BASE, "set 1"), "another start", Measured(0, 0.951, 4, 0.983)),
    Case("set 2", "hall", (BASE, "set 2"), "0.1 m cells", Measured(0, 0.914, 2, 0.969)),
    Case("set 3", "hall", (BASE, "set 3"), "noise 0.1 m", Measured(0, 0.912, 2, 0.957)),
    Case("noise 0.05 m", "hall", (BASE, "noise 0.05 m"), "noise 0.05 m", Measured(0, 0.923, 1, 0.971)),
    Case("noise 0.5 m", "hall", (BASE, "noise 0.5 m"), "noise 0.5 m", Measured(0, 0.946, 0, 0.937)),
    Case("0.025 m cells", "hall", (BASE, "0.025 m cells"), "0.025 m cells", Measured(0, 0.965, 1, 0.988)),
    Case("0.2 m cells", "hall", (BASE, "0.2 m cells"), "0.2 m cells", Measured(0, 0.884, 2, 0.948)),
    Case("office 1 and 3", "floor", ("robot 1", "robot 3"), "another wing", Measured(20, 0.964, None, 0.970)),
    Case("office 2 and 3", "floor", ("robot 2", "robot 3"), "another wing", Measured(20, 0.967, 3, 0.973)),
    Case("office 1 and 2", "floor", ("robot 1", "robot 2"), "opposite wings"),
    Case("office, all three", "floor", FLOOR_MAPS, "three wings"),
)
