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
from sim.policies.patrol import Patrol, check_goals, draw_goals
from worlds.raster import true_raster
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
        Navigator(robot, rank, policy, stopwatch, world.fence, settings.behaviour.navigation)
        for rank, (robot, policy) in enumerate(zip(settings.robots, policies, strict=True))
    ]


def _explorations(settings: MissionSettings, starts: Sequence[SE2]) -> list[Policy]:
    """Build one exploration per robot. Robots that start close together each get a direction to explore first."""
    count = len(settings.robots)
    sides = [starts[0].yaw + math.tau * rank / count if settings.starts == "close" else None for rank in range(count)]
    exploration = settings.behaviour.exploration
    return [
        FrontierExploration(robot.lidar, side, exploration) for robot, side in zip(settings.robots, sides, strict=True)
    ]


def make_patrols(world: World, settings: MissionSettings, starts: Sequence[SE2], seed: int) -> list[Patrol]:
    """Build one patrol per robot. Raises ``ValueError`` with a goal out of reach."""
    behaviour = settings.behaviour
    patrol = behaviour.patrol
    plan = true_raster(world, patrol.plan_cell)
    check_goals(world, settings.goals, starts, max(robot.radius for robot in settings.robots), patrol.plan_cell)
    patrols = []
    for rank, (robot, start) in enumerate(zip(settings.robots, starts, strict=True)):
        drawn = settings.goals or draw_goals(stream(seed, Role.POLICY, rank), world, start, robot.radius, patrol)
        patrols.append(Patrol(plan, drawn, rank, behaviour))
    return patrols
