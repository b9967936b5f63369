"""Settings of the navigator: how a robot follows paths, avoids obstacles and lets others pass."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any


def require_positive(settings: Any, negative: tuple[str, ...] = ()) -> None:
    """Raise ``ValueError`` with the field and its value if a number, also in nested settings, is not positive and
    finite; the fields ``negative`` must be negative and finite."""
    for each in fields(settings):
        value = getattr(settings, each.name)
        if is_dataclass(value):
            require_positive(value, negative)
            continue
        sign, kind = (-1.0, "negative") if each.name in negative else (1.0, "positive")
        if not all(
            math.isfinite(one) and sign * one > 0.0 for one in (value if isinstance(value, tuple) else (value,))
        ):
            raise ValueError(f"{type(settings).__name__}: {each.name} is {value}, must be {kind} and finite")


@dataclass(frozen=True)
class SteeringSettings:
    """Set up the choice of a motion.

    - ``horizon`` [s], ``steps``: time over which a motion is simulated, and its number of steps;
    - ``hull_margin`` [m]: least clearance between the hull and anything seen;
    - ``comfort`` [m]: clearance below which a motion gets a penalty;
    - ``max_seen``: points that are checked, at most; more of them add no information.
    """

    horizon: float = 1.2
    steps: int = 12
    hull_margin: float = 0.06
    comfort: float = 0.2
    max_seen: int = 120


@dataclass(frozen=True)
class RouteSettings:
    """Set up the planning of paths.

    - ``wall_distance`` [m], ``wall_cost``: cells nearer than this to a wall cost up to this much more, so that paths
      keep to the middle of doors and corridors;
    - ``escape`` [m]: free cells this near to the robot are passable even next to a wall, so that it can leave tight
      spots.
    """

    wall_distance: float = 0.5
    wall_cost: float = 4.0
    escape: float = 0.35


@dataclass(frozen=True)
class TrackingSettings:
    """Set up the tracking of the nearest moving object.

    - ``size`` [m]: points this near to the nearest one belong to the same robot;
    - ``fastest`` [m/s]: a faster apparent motion means that the nearest object has changed;
    - ``passing_speed`` [m/s]: least speed of an object that is passing;
    - ``newest_weight``: weight of the newest estimate of the velocity.
    """

    size: float = 0.6
    fastest: float = 2.0
    passing_speed: float = 0.1
    newest_weight: float = 0.5


@dataclass(frozen=True)
class RightOfWaySettings:
    """Set up which of two robots goes first.

    - ``near`` [m]: robots farther than this are ignored;
    - ``path_width`` [m]: a robot blocks the path if it is nearer than this to it;
    - ``similar_room`` [m]: clearances that differ by less count as equal, because the two robots' maps differ;
    - ``max_retreat`` [m]: longest path that a robot drives to let another pass;
    - ``passing_distance`` [m]: distance from the other robot's line of travel at which it can pass;
    - ``wait_with_more_room``, ``wait_with_equal_room``, ``wait_with_less_room`` [s]: time that a robot waits before it
      gives way, by its room compared with the other's;
    - ``wait_per_rank``, ``wait_per_four_ranks`` [s]: extra waiting time per rank modulo four, and per four ranks, so
      that not all robots give way at once;
    - ``yield_time`` [s], ``clear_distance`` [m]: a robot that gave way waits at least and at most this long; in
      between, until no other robot is this near.
    """

    near: float = 1.0
    path_width: float = 0.55
    similar_room: float = 0.1
    max_retreat: float = 5.0
    passing_distance: float = 0.9
    wait_with_more_room: float = 0.6
    wait_with_equal_room: float = 2.0
    wait_with_less_room: float = 6.0
    wait_per_rank: float = 2.0
    wait_per_four_ranks: float = 0.1
    yield_time: tuple[float, float] = (3.0, 8.0)
    clear_distance: float = 1.6


@dataclass(frozen=True)
class StuckSettings:
    """A robot is stuck if it moved less than ``distance`` [m] and turned less than ``turn`` [rad] in ``time`` [s].

    ``ban_time`` [s]: time for which a goal that it could not reach is excluded.
    """

    time: float = 3.0
    distance: float = 0.15
    turn: float = 0.5
    ban_time: float = 15.0


@dataclass(frozen=True)
class NavigationSettings:
    """Set up a navigator.

    - ``replan_time`` [s]: longest time that a plan is kept;
    - ``lookahead`` [m]: least and greatest lookahead distance on the path;
    - ``arrived`` [m]: distance at which the end of a path counts as reached;
    - ``look_around`` [rad/s]: turn rate of a robot that has no path and no full view;
    - ``free_log_odds``: log-odds below which a cell is certainly free: about three observations;
    - ``fence_spacing`` [m]: distance between the points that represent a fence.
    """

    replan_time: float = 2.5
    lookahead: tuple[float, float] = (0.2, 0.9)
    arrived: float = 0.3
    look_around: float = 0.6
    free_log_odds: float = -1.2
    fence_spacing: float = 0.05
    steering: SteeringSettings = field(default_factory=SteeringSettings)
    routes: RouteSettings = field(default_factory=RouteSettings)
    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    right_of_way: RightOfWaySettings = field(default_factory=RightOfWaySettings)
    stuck: StuckSettings = field(default_factory=StuckSettings)
