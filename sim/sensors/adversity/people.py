"""Let people walk about, and out of the way of robots."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.seeds import Role, stream
from sim.sensors.adversity.free_floor import FreeFloor, clear_length, on_floor
from sim.sensors.adversity.settings import STEP, Adversity

SLOWEST = 0.3
"""Least walking speed [m/s]: the normal distribution has no lower bound."""
FARTHEST = 20.0
"""Longest straight walk [m]."""
ASIDE = tuple(math.radians(angle) for angle in (0, 30, -30, 60, -60, 90, -90))
"""Directions to step aside, tried in this order; 0 leads straight away from the robot [rad]."""
CHOICES = 8
"""Random directions of which a person chooses one, in proportion to how far it can walk."""


@dataclass(frozen=True, eq=False)
class People:
    """Hold the ``places`` (T, P, 2) [m] of people every ``STEP`` from time 0, and the ``radius`` [m] of each disc."""

    places: NDArray[np.float64]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", frozen_array(self.places, np.float64))

    def at(self, time: float) -> NDArray[np.float64]:
        """Return the places (P, 2) [m] at a time [s]."""
        last = len(self.places) - 1
        before = min(int(time / STEP), last)
        share = time / STEP - before
        places: NDArray[np.float64] = (1.0 - share) * self.places[before] + share * self.places[min(before + 1, last)]
        return places


def walk(floor: FreeFloor, robots: NDArray[np.float64], adversity: Adversity, seed: int) -> People:
    """Simulate the people of a mission.

    ``robots`` (T, R, 2) [m] are the places of the robots every ``STEP``. Each person has a random stream of its own and
    does not mind the others, so that people of a lower density are among those of a higher one. Places depend on
    nothing that comes later. People follow the random direction model (Camp, Boleng and Davies 2002), but stop anywhere
    on the way to the wall.
    """
    places = np.empty((len(robots), floor.count(adversity.people), 2))
    for person in range(places.shape[1]):
        rng = stream(seed, Role.PEOPLE, person)
        start = floor.random_place(rng)
        speed = adversity.person_speed + adversity.person_speed_sigma * rng.standard_normal()
        places[:, person] = _walk_alone(
            floor.cells,
            robots,
            start,
            max(SLOWEST, speed) * STEP,
            adversity.person_pause,
            adversity.personal_space,
            rng,
        )
    return People(places, adversity.person_radius)


@njit(cache=True)
def _walk_alone(
    cells: NDArray[np.bool_],
    robots: NDArray[np.float64],
    start: NDArray[np.float64],
    reach: float,
    pause: float,
    space: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the places (T, 2) [m] of one person that walks ``reach`` [m] in a step."""
    places = np.empty((len(robots), 2))
    x, y = start
    goal_x, goal_y = _next_goal(cells, x, y, rng)
    until = pause * rng.random()
    for step in range(len(robots)):
        near_x, near_y = _nearest(robots[step], x, y)
        if step > 0 and math.hypot(x - near_x, y - near_y) < space:
            x, y = _aside(cells, x, y, math.atan2(y - near_y, x - near_x), reach)
        elif step > 0 and step * STEP >= until:
            length = math.hypot(goal_x - x, goal_y - y)
            share = 1.0 if length <= reach else reach / length
            next_x, next_y = x + share * (goal_x - x), y + share * (goal_y - y)
            if not on_floor(cells, next_x, next_y):
                goal_x, goal_y = _next_goal(cells, x, y, rng)
            elif math.hypot(next_x - near_x, next_y - near_y) >= space:
                x, y = next_x, next_y
                if length <= reach:
                    goal_x, goal_y = _next_goal(cells, x, y, rng)
                    until = step * STEP + pause * rng.standard_exponential()
        places[step] = x, y
    return places


@njit(cache=True)
def _nearest(robots: NDArray[np.float64], x: float, y: float) -> tuple[float, float]:
    best = robots[0]
    for robot in robots[1:]:
        if math.hypot(robot[0] - x, robot[1] - y) < math.hypot(best[0] - x, best[1] - y):
            best = robot
    return best[0], best[1]


@njit(cache=True)
def _aside(cells: NDArray[np.bool_], x: float, y: float, away: float, reach: float) -> tuple[float, float]:
    """Take one step in the first free direction; stay if there is none."""
    for angle in ASIDE:
        to_x, to_y = x + reach * math.cos(away + angle), y + reach * math.sin(away + angle)
        if on_floor(cells, to_x, to_y):
            return to_x, to_y
    return x, y


@njit(cache=True)
def _next_goal(cells: NDArray[np.bool_], x: float, y: float, rng: np.random.Generator) -> tuple[float, float]:
    angles, lengths = np.empty(CHOICES), np.empty(CHOICES)
    for k in range(CHOICES):
        angles[k] = math.tau * rng.random()
        lengths[k] = clear_length(cells, x, y, math.cos(angles[k]), math.sin(angles[k]), FARTHEST)
    left, chosen = rng.random() * lengths.sum(), 0
    while chosen < CHOICES - 1 and left >= lengths[chosen]:
        left -= lengths[chosen]
        chosen += 1
    length = rng.random() * lengths[chosen]
    return x + length * math.cos(angles[chosen]), y + length * math.sin(angles[chosen])
