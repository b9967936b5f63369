"""Cases of the thesis, and the trials of the ablation: how the two maps of a pair are made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

Place = Literal["hall", "floor"]
PLACES: tuple[Place, ...] = ("hall", "floor")

RESOLUTION, RANGE_SIGMA = 0.05, 0.005
"""Default cell size and range noise [m]."""

CLEAR_RANGE = 4.9
"""Range that beams without a return clear [m] where they do; the thesis's own clear nothing."""

Mapper = Literal["log-odds", "counts", "particles"]
"""Log-odds or counts of hits at true poses, or the particle filter in the manner of gmapping, which counts as well."""


@dataclass(frozen=True)
class Overlap:
    """Common cells as a share of the second map and of the first, the known share of the hall in the first map, and the
    unknown share inside the outline of the second.

    The missions are chosen and cut so that their true footprints come as near as they can; None leaves a share free.
    """

    of_second: float
    of_first: float
    known: float = 0.64
    holes: float | None = None


@dataclass(frozen=True)
class Condition:
    """The making of a pair of maps of the hall.

    - ``overlap``: None takes the whole missions, which cover the hall;
    - ``start``: of the second robot; the first has the first start;
    - ``clear_range`` [m]: beams without a return clear so far;
    - ``resolution`` [m], ``range_sigma`` [m]: cell size and range noise of the second map.
    """

    overlap: Overlap | None
    start: int = 4
    clear_range: float = 0.0
    mapper: Mapper = "log-odds"
    resolution: float = RESOLUTION
    range_sigma: float = RANGE_SIGMA

    @property
    def full_coverage(self) -> Condition:
        """Return the same with whole missions and cleared beams."""
        return replace(self, overlap=None, clear_range=CLEAR_RANGE)


@dataclass(frozen=True)
class Measured:
    """Results of the thesis's own scripts on its own maps for one case.

    Right runs of the existing pipeline, of 20, and its acceptance index; right runs of the corrected pipeline, of 5,
    None if it was not run; the index at the truth; and the index that the thesis reports for the corrected pipeline.
    """

    plain: int
    plain_index: float
    corrected: int | None
    true_index: float
    reported_index: float | None = None


@dataclass(frozen=True)
class Case:
    """A case of the thesis, as its maps are; ``condition`` is for the hall.

    ``pieces`` is the number of separate pieces of wall in the thesis's second map, where its noise is not the usual.
    """

    name: str
    differs: str
    measured: Measured | None
    overlap: Overlap
    condition: Condition = Condition(None)
    pieces: int | None = None


HOLES = 0.19
"""The thesis: 0.18 to 0.20 in the second maps of set 1 and of other noise or cells, which the other sets are."""


def _hall(
    name: str, differs: str, measured: Measured, overlap: Overlap, pieces: int | None = None, **changed: Any
) -> Case:
    return Case(name, differs, measured, overlap, Condition(replace(overlap, holes=HOLES), **changed), pieces)


HALL_CASES = (
    _hall("set 1", "rotation of 245 degrees", Measured(0, 0.951, 4, 0.983, 0.9936), Overlap(0.70, 0.44), start=3),
    _hall("set 2", "0.1 m cells", Measured(0, 0.914, 2, 0.969, 0.9896), Overlap(0.61, 0.48), resolution=0.1),
    _hall(
        "set 3", "noise 0.1 m", Measured(0, 0.912, 2, 0.957, 0.9783), Overlap(0.58, 0.46), range_sigma=0.1, pieces=132
    ),
    _hall("noise 0.05 m", "", Measured(0, 0.923, 1, 0.971), Overlap(0.60, 0.51), range_sigma=0.05, pieces=44),
    _hall("noise 0.5 m", "", Measured(0, 0.946, 0, 0.937), Overlap(0.57, 0.52), range_sigma=0.5, pieces=1622),
    _hall("0.025 m cells", "", Measured(0, 0.965, 1, 0.988), Overlap(0.61, 0.46), resolution=0.025),
    _hall("0.2 m cells", "", Measured(0, 0.884, 2, 0.948), Overlap(0.59, 0.49), resolution=0.2),
)
"""Set 1 differs by 245 degrees, the others by 188."""

SETS = HALL_CASES[:3]

FLOOR_MAPS = ("robot 1", "robot 2", "robot 3")
"""Names of the robots in the floor's left, right and lower corridor."""

TEAM = "office, all three"

FLOOR_CASES = (
    Case("office 1 and 3", "another wing", Measured(20, 0.964, None, 0.970, 0.9847), Overlap(0.45, 0.40)),
    Case("office 2 and 3", "another wing", Measured(20, 0.967, 3, 0.973, 0.9835), Overlap(0.60, 0.47)),
    Case("office 1 and 2", "opposite wings", None, Overlap(0.04, 0.05)),
)
"""The names of the cases hold the numbers of the robots."""

CASES = HALL_CASES + FLOOR_CASES


@dataclass(frozen=True)
class Trial:
    """A condition under its name, and the group of methods that run on its pairs (``methods.GROUPS``)."""

    name: str
    condition: Condition
    methods: Literal["sets", "case", "ablation"]


FULL = ", full coverage"
LEVELS = (0.3, 0.45, 0.6, 0.75, 0.9)
"""Overlaps of the ablation, of either map, at the same known share of the hall."""
KNOWN = 0.6
WHOLE = 1.0
"""The level of whole missions."""
LOW_LEVEL, HIGH_LEVEL = 0.6, 0.9
"""The overlaps at which the other factors vary: about the thesis's own, and one at which descriptors still work."""


def plane_name(level: float, cleared: bool) -> str:
    amount = "whole missions" if level == WHOLE else f"overlap {level:g}"
    return f"{amount}, {'cleared' if cleared else 'not cleared'}"


def at_level(level: float, known: float = KNOWN, **changed: Any) -> Condition:
    return Condition(None if level == WHOLE else Overlap(level, level, known), **changed)


FACTORS: dict[str, dict[str, Any]] = {
    "as the thesis's maps": {},
    "less of the hall known": {"known": 0.4},
    "cleared to 4.9 m": {"clear_range": CLEAR_RANGE},
    "counts": {"mapper": "counts"},
    "particle filter": {"mapper": "particles"},
    "noise 0.05 m": {"range_sigma": 0.05},
    "noise 0.1 m": {"range_sigma": 0.1},
    "noise 0.5 m": {"range_sigma": 0.5},
    "0.025 m cells": {"resolution": 0.025},
    "0.1 m cells": {"resolution": 0.1},
    "0.2 m cells": {"resolution": 0.2},
}
"""One property at a time is changed, at either level."""


def factor_name(factor: str, level: float) -> str:
    """Name the trial of a factor; those that are in the plane have its names."""
    in_plane = {"as the thesis's maps": False, "cleared to 4.9 m": True}
    return plane_name(level, in_plane[factor]) if factor in in_plane else f"{factor}, overlap {level:g}"


def trials() -> tuple[Trial, ...]:
    """List the trials in the hall: cases, the same with full coverage, and the ablation."""
    found = [Trial(case.name, case.condition, "sets" if case in SETS else "case") for case in HALL_CASES]
    found += [Trial(case.name + FULL, case.condition.full_coverage, "ablation") for case in HALL_CASES]
    for level in (*LEVELS, WHOLE):
        for cleared in (False, True):
            condition = at_level(level, clear_range=CLEAR_RANGE if cleared else 0.0)
            found.append(Trial(plane_name(level, cleared), condition, "ablation"))
    for factor, changed in FACTORS.items():
        for level in (LOW_LEVEL, HIGH_LEVEL):
            found.append(Trial(factor_name(factor, level), at_level(level, **changed), "ablation"))
    return tuple({trial.name: trial for trial in found}.values())
