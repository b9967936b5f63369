"""Set up a mission: team, duration, starts, drive and policy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from sim.navigation.settings import require_positive
from sim.physics.drive import DRIVES, Drive
from sim.physics.robot import MAX_ROBOTS, RobotSettings
from sim.policies.settings import BehaviourSettings

Starts = Literal["random", "spread", "close"]
"""random: the world's own starts, then anywhere; spread: as far apart as possible; close: as near together as possible.
"""

STARTS: tuple[str, ...] = get_args(Starts)

PolicyName = Literal["explore", "patrol", "replay"]
"""explore: drive to where most is unknown; patrol: drive between goals; replay: follow given trajectories."""

POLICIES: tuple[str, ...] = get_args(PolicyName)


LONGEST = 86_400.0
"""Longest mission [s]: one day."""


@dataclass(frozen=True)
class CutSettings:
    """Set up the search for the ends of missions that reach an overlap.

    - ``levels``: number of end times tried for each robot, spaced evenly;
    - ``shortest``: smallest fraction of a robot's mission that is kept;
    - ``overlap_margin``: distance from the limits of the target range that is aimed at, if the range is wide enough;
    - ``rounds``: of the coordinate descent, at most;
    - ``draws``: of each kind of starts, at most, until an overlap is reached; each costs a simulation;
    - ``gap`` [m]: close starts of each further draw are that much further apart, by path length. Robots a room apart
      share about half of what they see.
    """

    levels: int = 60
    shortest: float = 0.05
    overlap_margin: float = 0.002
    rounds: int = 20
    draws: int = 4
    gap: float = 3.0

    def __post_init__(self) -> None:
        require_positive(self)


@dataclass(frozen=True, init=False)
class MissionSettings:
    """Set up a team that drives for ``duration`` seconds.

    ``robots`` is a number of equal robots, or one settings record per robot. ``starts`` places the robots without a
    start of their own. ``drive`` is how they move. ``policy`` chooses their paths. ``goals``, x, y [m], are for the
    policy ``patrol``: robots visit them in turn, each beginning with another one; without any, each robot draws its
    own. ``overlap`` is the least and greatest overlap of the true footprints of any two robots; ``cut`` is how
    missions are shortened to reach it. ``behaviour`` tunes policies and navigation.

    Raises ``ValueError`` with the field and its value.
    """

    robots: tuple[RobotSettings, ...]
    duration: float
    starts: Starts
    drive: Drive
    policy: PolicyName
    goals: tuple[tuple[float, float], ...]
    overlap: tuple[float, float] | None
    behaviour: BehaviourSettings
    cut: CutSettings

    def __init__(
        self,
        robots: int | Sequence[RobotSettings] = 3,
        duration: float = 120.0,
        starts: Starts = "random",
        drive: Drive = "velocity",
        policy: PolicyName = "explore",
        goals: Sequence[tuple[float, float]] = (),
        overlap: tuple[float, float] | None = None,
        behaviour: BehaviourSettings = BehaviourSettings(),
        cut: CutSettings = CutSettings(),
    ) -> None:
        count = robots if isinstance(robots, int) else len(robots)
        if not 1 <= count <= MAX_ROBOTS:
            raise ValueError(f"MissionSettings: robots is {count}, must lie between 1 and {MAX_ROBOTS}")
        team = (RobotSettings(),) * robots if isinstance(robots, int) else tuple(robots)
        object.__setattr__(self, "robots", team)
        object.__setattr__(self, "duration", float(duration))
        object.__setattr__(self, "starts", starts)
        object.__setattr__(self, "drive", drive)
        object.__setattr__(self, "policy", policy)
        object.__setattr__(self, "goals", tuple((float(x), float(y)) for x, y in goals))
        object.__setattr__(self, "overlap", None if overlap is None else (float(overlap[0]), float(overlap[1])))
        object.__setattr__(self, "behaviour", behaviour)
        object.__setattr__(self, "cut", cut)
        self._check()

    def _check(self) -> None:
        for name, kind in (("behaviour", BehaviourSettings), ("cut", CutSettings)):
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"MissionSettings: {name} is {getattr(self, name)!r}, must be {kind.__name__}")
        if not 0.0 < self.duration <= LONGEST:
            raise ValueError(
                f"MissionSettings: duration is {self.duration}, must be positive and at most {LONGEST:g} s"
            )
        for name, known in (("starts", STARTS), ("drive", DRIVES), ("policy", POLICIES)):
            if getattr(self, name) not in known:
                raise ValueError(f"MissionSettings: {name} is {getattr(self, name)!r}, must be {', '.join(known)}")
        if self.goals and self.policy != "patrol":
            raise ValueError(f"MissionSettings: goals are for the policy patrol, but the policy is {self.policy}")
        for goal in self.goals:
            if not all(math.isfinite(number) for number in goal):
                raise ValueError(f"MissionSettings: goals holds {goal}, must be finite")
        if self.overlap is not None:
            low, high = self.overlap
            if not 0.0 <= low < high <= 1.0:
                raise ValueError(f"MissionSettings: overlap is {low:g}:{high:g}, must be LO:HI with 0 <= LO < HI <= 1")
            if len(self.robots) < 2:
                raise ValueError(f"MissionSettings: overlap is {low:g}:{high:g}, needs at least two robots")
