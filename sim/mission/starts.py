"""Where robots begin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from mapping.geometry.se2 import SE2
from sim.mission.robot import RobotSettings
from sim.mission.start_draws import DRAWS, Chosen, StandingPlaces, is_apart
from worlds.floor import CLEAR
from worlds.world import World

Starts = Literal["random", "spread", "close"]
"""random: the world's own, then anywhere; spread: as far apart as possible; close: as near one another as they fit."""

STARTS: tuple[str, ...] = get_args(Starts)


def choose_starts(
    rng: np.random.Generator, world: World, robots: Sequence[RobotSettings], how: Starts = "random"
) -> tuple[SE2, ...]:
    """world_from_base for each robot: its own start if it has one, else one that is chosen on the largest floor that
    robots of this size can drive.

    Each chosen one stands with its centre at least 0.5 m (or its radius and 0.1 m) from any solid and twice that from
    the others, in any heading. In a world of several parts the robots go to one after the other, but all to one part
    where they begin close. Raises ``ValueError`` where a given start is in a wall or overlaps another robot's, and
    where the floor does not hold that many.
    """
    check_starts(world, robots)
    radius = max(robot.radius for robot in robots)
    clear = max(CLEAR, radius + 0.1)
    draw = DRAWS[how](rng, StandingPlaces(world, radius, clear))
    headings = rng.uniform(-math.pi, math.pi, len(robots))
    given = [robot.start for robot in robots if robot.start is not None]
    taken: Chosen = list(given)
    own = [start for start in own_starts(world) if how == "random" and is_apart(start, taken, clear)]
    starts: Chosen = []
    for index, robot in enumerate(robots):
        start = robot.start
        if start is None and own:
            start = own.pop(0)
            taken.append(start)
        elif start is None:
            place = draw(index, taken)
            if place is None:
                raise ValueError(
                    f"robots is {len(robots)}, but world {world.name!r} has clear standing room for {len(taken)} only"
                )
            start = SE2(place.x, place.y, float(headings[index]))
            taken.append(start)
        starts.append(start)
    return tuple(starts)


def random_starts(rng: np.random.Generator, world: World, robots: int, radius: float = 0.2) -> tuple[SE2, ...]:
    """``choose_starts`` for as many equal robots of ``radius`` [m]: the world's own starts, then anywhere."""
    return choose_starts(rng, world, (RobotSettings(radius=radius),) * robots)


def check_starts(world: World, robots: Sequence[RobotSettings]) -> None:
    """Raise ``ValueError`` where a given start lies outside the world, in a wall, or on another robot's."""
    given = [(index, robot, robot.start) for index, robot in enumerate(robots) if robot.start is not None]
    for index, robot, start in given:
        told = f"start {index} at ({start.x:g}, {start.y:g})"
        fault = world.fault_at(start.x, start.y)
        if fault is not None:
            raise ValueError(f"{told} is {fault}")
        gap = float(world.clearance([(start.x, start.y)])[0])
        if gap <= robot.radius:
            raise ValueError(
                f"{told} is {gap:.2f} m from {world.bounds} of world {world.name!r}, but the robot's radius is "
                f"{robot.radius:g} m"
            )
        for other_index, other, at in given[:index]:
            distance = math.dist((start.x, start.y), (at.x, at.y))
            if other_index < index and distance <= robot.radius + other.radius:
                raise ValueError(
                    f"{told} overlaps start {other_index} at ({at.x:g}, {at.y:g}): {distance:.2f} m apart, the robots "
                    f"need {robot.radius + other.radius:g} m"
                )


def own_starts(world: World) -> list[SE2]:
    """The starts that the world brings, without those less than 1 m from one before: they are alternatives."""
    apart: list[SE2] = []
    for start in world.starts:
        if is_apart(start, apart, CLEAR):
            apart.append(start)
    return apart
