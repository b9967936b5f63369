"""The truth of a mission."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mapping.robot.robot_log import RobotTruth
from sim.mission.settings import MissionSettings
from worlds.world import World


@dataclass(frozen=True, eq=False)
class Mission:
    """Hold the truth of each robot in a ``world``. Robots with different lidars have different stamps.

    A mission does not depend on sensor noise; ``sense`` adds the noise afterwards. ``contacts`` counts for each robot
    the scan periods in which it touched a wall or another robot. If the mission was cut to reach an overlap, truths end
    before ``settings.duration``.
    """

    world: World
    robots: tuple[RobotTruth, ...]
    seed: int
    settings: MissionSettings
    contacts: tuple[int, ...]

    def cut(self, scans: Sequence[int]) -> Mission:
        """Keep only the first ``scans[i]`` scans of each robot i."""
        robots = tuple(truth.part(0, count) for truth, count in zip(self.robots, scans, strict=True))
        return replace(self, robots=robots)
