"""A team of robots exploring a world: simulated once, kept clean."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.robot_log import RobotTruth
from mapping.scan import LidarScan
from mapping.se2 import SE2
from mapping.seeds import Role, stream
from mapping.trajectory import Trajectory
from sim.bullet import BulletScene
from sim.drive import DriveLimits
from sim.explore import Explorer
from sim.lidar import Lidar
from sim.starts import random_starts
from sim.stopwatch import Stopwatch
from worlds.world import World

PHYSICS_STEP = 0.01
"""Longest time step of the physics [s]."""


@dataclass(frozen=True)
class MissionSettings:
    """``robots`` of ``radius`` [m] drive for ``duration`` seconds, all with the same lidar and limits.

    Raises ``ValueError`` naming the field and its value.
    """

    robots: int = 3
    duration: float = 120.0
    lidar: Lidar = field(default_factory=Lidar)
    limits: DriveLimits = field(default_factory=DriveLimits)
    radius: float = 0.2

    def __post_init__(self) -> None:
        if self.robots < 1:
            raise ValueError(f"MissionSettings: robots is {self.robots}, must be at least 1")
        for name in ("duration", "radius"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"MissionSettings: {name} is {value}, must be positive and finite")

    @property
    def scans(self) -> int:
        """How many scans each robot takes: the first at 0 s, the last at or just before the end."""
        return math.floor(self.duration * self.lidar.rate + 1e-9) + 1


@dataclass(frozen=True, eq=False)
class Mission:
    """What truly happened: one truth a robot, all of the same stamps, in a ``world``.

    Nothing in it depends on sensor noise; :func:`sim.noise.sense` draws the noise on it afterwards. ``touches``
    counts for each robot the scan periods in which it touched a wall or another robot.
    """

    world: World
    robots: tuple[RobotTruth, ...]
    robot_radius: float
    seed: int
    settings: MissionSettings
    touches: tuple[int, ...]


@dataclass(frozen=True)
class MissionTimes:
    """Seconds of wall time that a mission took, by what they went into. They are no part of the mission."""

    building: float = 0.0
    physics: float = 0.0
    rays: float = 0.0
    mapping: float = 0.0
    planning: float = 0.0
    total: float = 0.0


def simulate(
    world: World,
    settings: MissionSettings,
    seed: int,
    on_progress: Callable[[float], None] | None = None,
) -> tuple[Mission, MissionTimes]:
    """Let the robots explore the world. Equal arguments give an equal mission, bit for bit, in any process.

    Every robot scans ``lidar.rate`` times a second from 0 s to the end; one that finds nothing more to see stands
    still and goes on scanning, and is still seen by the others. ``on_progress`` is told the simulated time [s]
    after each scan. Raises ``ValueError`` where the world does not hold the robots, ``ImportError`` without PyBullet.
    """
    stopwatch = Stopwatch()
    with stopwatch.on("total"), ExitStack() as stack:
        with stopwatch.on("building"):
            starts = random_starts(stream(seed, Role.STARTS), world, settings.robots, settings.radius)
            scene = stack.enter_context(BulletScene(world, starts, settings.radius))
        mission = _run(scene, world, settings, seed, stopwatch, on_progress)
    return mission, MissionTimes(**stopwatch.seconds)


class _Recorder:
    """Collects what happens to one robot."""

    def __init__(self) -> None:
        self.scans: list[LidarScan] = []
        self.poses: list[tuple[float, float, float]] = []
        self.hits_robot: list[NDArray[np.bool_]] = []

    def add(self, scan: LidarScan, pose: SE2, hits_robot: NDArray[np.bool_]) -> None:
        self.scans.append(scan)
        self.poses.append((pose.x, pose.y, pose.yaw))
        self.hits_robot.append(hits_robot)

    def truth(self, lidar: Lidar) -> RobotTruth:
        stamps = np.array([scan.stamp for scan in self.scans])
        trajectory = Trajectory(stamps, np.array(self.poses))
        return RobotTruth(tuple(self.scans), trajectory, np.array(self.hits_robot), lidar.base_from_lidar)


def _run(
    scene: BulletScene,
    world: World,
    settings: MissionSettings,
    seed: int,
    stopwatch: Stopwatch,
    on_progress: Callable[[float], None] | None,
) -> Mission:
    lidar = settings.lidar
    explorers = [
        Explorer(lidar, settings.limits, settings.radius, stopwatch, world.fence) for _ in range(settings.robots)
    ]
    recorders = [_Recorder() for _ in explorers]
    touches = np.zeros(settings.robots, dtype=np.int64)
    steps = math.ceil(1.0 / (lidar.rate * PHYSICS_STEP) - 1e-9)
    commands: list[tuple[float, float]] = []
    for tick in range(settings.scans):
        if tick > 0:
            with stopwatch.on("physics"):
                touches += scene.advance(commands, 1.0 / (lidar.rate * steps), steps)
        commands = []
        for robot, (explorer, recorder) in enumerate(zip(explorers, recorders, strict=True)):
            with stopwatch.on("rays"):
                distances, hits_robot = scene.cast(robot, lidar)
            scan, pose = lidar.scan(tick / lidar.rate, distances), scene.pose(robot)
            recorder.add(scan, pose, hits_robot & scan.returned)
            commands.append(explorer.command(scan, pose))
        if on_progress is not None:
            on_progress(tick / lidar.rate)
    truths = tuple(recorder.truth(lidar) for recorder in recorders)
    return Mission(world, truths, settings.radius, seed, settings, tuple(touches.tolist()))
