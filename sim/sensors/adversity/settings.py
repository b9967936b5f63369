"""Set the adversities: each is off at 0."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

_MOST = {
    "people": 100.0,
    "doors": 1.0,
    "objects": 100.0,
    "glass": 1.0,
    "glass_angle": math.pi / 2.0,
    "ramps": 100.0,
    "ramp_slope": math.pi / 4.0,
}
"""Upper bounds of densities, shares and angles."""
STEP = 0.1
"""Time between two computed places of a person [s]; they are interpolated in between."""
LARGEST = 1e3
"""Upper bound of every other component, in its own unit."""

AMOUNTS = ("people", "doors", "objects", "glass", "ramps", "slip", "latency", "jitter")
"""The components that switch an adversity on, and that a level multiplies."""
_IN_WORLD = AMOUNTS[:5]
_POSITIVE = ("person_radius", "change_time", "object_size", "pane_width", "ramp_radius", "lidar_height", "slip_tail")


@dataclass(frozen=True)
class Adversity:
    """Hold the amount of each adversity, 0 by default, and its properties.

    **People.** ``people`` walk on each 100 m^2 of floor. A person is a disc of ``person_radius`` [m] (0.15 m^2 of
    floor, Buchmueller and Weidmann 2006) that walks straight to a random place in sight and pauses there for
    ``person_pause`` [s] on average (assumed). Walking speeds are normal with mean ``person_speed`` and deviation
    ``person_speed_sigma`` [m/s] (Weidmann 1993). A person stops or steps aside within ``personal_space`` [m] of a
    robot's centre (Hall 1966: the personal distance is 0.5 to 1.2 m).

    **Doors and objects.** A share ``doors`` of the doorways has a sliding door, and ``objects``, boxes of side
    ``object_size`` [m], come and go on each 100 m^2. A door is closed, then open, an object stands somewhere, then is
    gone, each for an exponentially distributed time of mean ``change_time`` [s]: the two-state Markov process of
    Meyer-Delius, Beinhofer and Burgard 2012 (the mean is assumed). Both make way for a robot within
    ``opening_distance`` [m].

    **Glass.** A share ``glass`` of the panes, ``pane_width`` [m] of wall each, returns only beams that hit it at up to
    ``glass_angle`` [rad] from its normal; others pass (Foster, Sun, Park and Kuipers 2013; the angle is assumed). They
    return what is behind, unless the solid is thicker than ``glass_depth`` [m]: then nothing.

    **Ramps.** There are ``ramps`` on each 100 m^2. A robot within ``ramp_radius`` [m] of its middle is tilted by
    ``ramp_slope`` [rad] (1:12, the steepest ramp of the ADA Standards for Accessible Design 2010, 405.2). Its lidar is
    ``lidar_height`` [m] above the floor (that of a TurtleBot3 Burger; solids look the same at any height).

    **Slip.** While turning, wheels slip ``slip`` times per radian on average (Borenstein and Feng 1996 name fast
    turning as a cause). Each slip adds to the rotation that odometry reports: ``slip_size`` [rad] times a Lomax variate
    of shape ``slip_tail``, which has a heavy tail (assumed).

    **Late scans.** A scan gets the odometry of the moment ``latency`` [s] later, plus an exponentially distributed
    time of mean ``jitter`` [s]: delays vary, but never fall below a least one (Olson 2010).

    Raises ``ValueError`` with the field and its value.
    """

    people: float = 0.0
    person_radius: float = 0.22
    person_speed: float = 1.34
    person_speed_sigma: float = 0.26
    person_pause: float = 10.0
    personal_space: float = 0.8
    doors: float = 0.0
    objects: float = 0.0
    object_size: float = 0.6
    change_time: float = 30.0
    opening_distance: float = 1.2
    glass: float = 0.0
    glass_angle: float = math.radians(15.0)
    glass_depth: float = 0.5
    pane_width: float = 1.5
    ramps: float = 0.0
    ramp_slope: float = math.atan(1.0 / 12.0)
    ramp_radius: float = 1.0
    lidar_height: float = 0.18
    slip: float = 0.0
    slip_size: float = 0.1
    slip_tail: float = 3.0
    latency: float = 0.0
    jitter: float = 0.0

    def __post_init__(self) -> None:
        for each in fields(self):
            value, most = getattr(self, each.name), _MOST.get(each.name, LARGEST)
            if not 0.0 <= value <= most:
                raise ValueError(f"Adversity: {each.name} is {value}, must lie between 0 and {most:g}")
            if each.name in _POSITIVE and value == 0.0:
                raise ValueError(f"Adversity: {each.name} is 0.0, must be positive")

    @property
    def in_world(self) -> bool:
        """Return True if something in the world changes what a lidar sees."""
        return any(getattr(self, name) > 0.0 for name in _IN_WORLD)

    def scaled(self, level: float) -> Adversity:
        """Multiply all amounts by ``level``, shares up to 1."""
        scaled = {name: level * getattr(self, name) for name in AMOUNTS}
        return replace(self, **scaled | {name: min(1.0, scaled[name]) for name in ("doors", "glass")})


LEVEL_ONE = Adversity(people=2.0, doors=0.3, objects=1.0, glass=0.1, ramps=1.0, slip=0.1, latency=0.05, jitter=0.02)
"""All adversities of a busy building: two people in a room of 100 m^2, every third door in use, a tenth of the walls of
glass, a slip in 10 rad, scans a twentieth of a second late. Assumed, to be varied by studies."""
