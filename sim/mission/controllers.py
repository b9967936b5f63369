"""Build the navigator and the policy of each robot."""

from __future__ import annotations

import math
from collections.abc import Sequence

from mapping.geometry.se2 import SE2
from mapping.seeds import Role, stream
from sim.mission.settings import MissionSettings
from sim.navigation.navigator import Navigator
from sim.navigation.policy import Policy
from sim.physics.stopwatch import Stopwatch
from sim.policies.explore import FrontierExploration
from sim.policies.patrol import Patrol, check_goals, draw_goals, floor_plan
from worlds.world import World


def make_navigators(
    world: World, settings: MissionSettings, starts: Sequence[SE2], seed: int, stopwatch: Stopwatch
) -> list[Navigator]:
    """Build one navigator per robot, with the mission's policy. Raises ``ValueError`` with a goal out of reach."""
    if settings.policy == "patrol":
        policies: Sequence[Policy] = make_patrols(world, settings, starts, seed)
    else:
        policies = _explorations(settings, starts)
    return [
        Navigator(robot, rank, policy, stopwatch, world.fence)
        for rank, (robot, policy) in enumerate(zip(settings.robots, policies, strict=True))
    ]


def _explorations(settings: MissionSettings, starts: Sequence[SE2]) -> list[Policy]:
    """Build one exploration per robot. Robots that start close together each get a direction to explore first."""
    count = len(settings.robots)
    sides = [starts[0].yaw + math.tau * rank / count if settings.starts == "close" else None for rank in range(count)]
    return [FrontierExploration(robot.lidar, side) for robot, side in zip(settings.robots, sides, strict=True)]


def make_patrols(world: World, settings: MissionSettings, starts: Sequence[SE2], seed: int) -> list[Patrol]:
    """Build one patrol per robot. Raises ``ValueError`` with a goal out of reach."""
    plan = floor_plan(world)
    check_goals(world, settings.goals, starts, max(robot.radius for robot in settings.robots))
    return [
        Patrol(plan, settings.goals or draw_goals(stream(seed, Role.POLICY, rank), world, start, robot.radius), rank)
        for rank, (robot, start) in enumerate(zip(settings.robots, starts, strict=True))
    ]
