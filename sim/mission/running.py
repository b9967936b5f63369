"""Run the simulation loop: time advances, robots scan, and each decides its next command."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotTruth
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from sim.physics.bodies import Command
from sim.physics.drive import Drive
from sim.physics.robot import RobotSettings
from sim.physics.stopwatch import Stopwatch
from sim.sensors.lidar import Lidar

if TYPE_CHECKING:
    from sim.physics.bullet import BulletScene

PHYSICS_STEP: dict[Drive, float] = {"velocity": 0.01, "wheels": 1.0 / 240.0}
"""Longest time step of the physics [s]."""


class Mover(Protocol):
    """Move the team between two scans."""

    def advance(self, start: float, seconds: float, commands: Sequence[Command]) -> NDArray[np.bool_]:
        """Advance by ``seconds`` from ``start`` [s]. Returns a mask (robots,) of the robots that touched something."""

    def decide(self, robot: int, scan: LidarScan, world_from_base: SE2) -> Command:
        """Return a robot's command from its scan until the next."""


class Driver(Protocol):
    """Drive one robot, as ``Navigator`` does."""

    def command(self, scan: LidarScan, world_from_base: SE2) -> Command:
        """Return the (forward speed [m/s], turn rate [rad/s]) to drive until the next scan."""


class Driven:
    """Move the bodies by physics, with commands from their drivers."""

    def __init__(self, scene: BulletScene, drive: Drive, drivers: Sequence[Driver], stopwatch: Stopwatch) -> None:
        self._scene, self._step = scene, PHYSICS_STEP[drive]
        self._drivers, self._stopwatch = drivers, stopwatch

    def advance(self, start: float, seconds: float, commands: Sequence[Command]) -> NDArray[np.bool_]:
        """Step the physics; see ``Mover``."""
        steps = math.ceil(seconds / self._step - 1e-9)
        with self._stopwatch.measure("physics"):
            return self._scene.advance(commands, seconds / steps, steps)

    def decide(self, robot: int, scan: LidarScan, world_from_base: SE2) -> Command:
        """Return the command of the robot's driver."""
        return self._drivers[robot].command(scan, world_from_base)


class Recorder:
    """Record the truth of one robot."""

    def __init__(self, lidar: Lidar) -> None:
        self._lidar = lidar
        self._scans: list[LidarScan] = []
        self._poses: list[tuple[float, float, float]] = []
        self._hits_robot: list[NDArray[np.bool_]] = []
        self.contacts = 0

    def add(self, scan: LidarScan, pose: SE2, hits_robot: NDArray[np.bool_]) -> None:
        """Add a scan, the robot's pose, and the mask of beams that end on a robot."""
        self._scans.append(scan)
        self._poses.append((pose.x, pose.y, pose.yaw))
        self._hits_robot.append(hits_robot)

    def truth(self) -> RobotTruth:
        """Return the recorded truth."""
        stamps = np.array([scan.stamp for scan in self._scans])
        trajectory = Trajectory(stamps, np.array(self._poses))
        return RobotTruth(tuple(self._scans), trajectory, np.array(self._hits_robot), self._lidar.base_from_lidar)


def run_team(
    scene: BulletScene,
    robots: Sequence[RobotSettings],
    duration: float,
    mover: Mover,
    stopwatch: Stopwatch,
    on_progress: Callable[[float], None] | None = None,
) -> tuple[Recorder, ...]:
    """Run all robots for ``duration`` seconds and record them. Each scans at its lidar's own rate, from 0 s on.

    Scan times are exact multiples of the periods, as fractions, so equal rates stay synchronous.
    """
    recorders = tuple(Recorder(robot.lidar) for robot in robots)
    periods = [1 / Fraction(robot.lidar.rate) for robot in robots]
    counts = [robot.scans(duration) for robot in robots]
    taken = [0] * len(robots)
    commands: list[Command] = [(0.0, 0.0)] * len(robots)
    touched = np.zeros(len(robots), dtype=np.bool_)
    now = Fraction(0)
    while True:
        for robot, recorder in enumerate(recorders):
            if taken[robot] < counts[robot] and taken[robot] * periods[robot] == now:
                stamp = taken[robot] / robots[robot].lidar.rate
                commands[robot] = _scan_and_decide(scene, robot, robots[robot].lidar, stamp, recorder, mover, stopwatch)
                recorder.contacts += int(touched[robot])
                touched[robot] = False
                taken[robot] += 1
        if on_progress is not None:
            on_progress(float(now))
        due = [taken[k] * periods[k] for k in range(len(robots)) if taken[k] < counts[k]]
        if not due:
            return recorders
        touched |= mover.advance(float(now), float(min(due) - now), commands)
        now = min(due)


def _scan_and_decide(
    scene: BulletScene,
    robot: int,
    lidar: Lidar,
    stamp: float,
    recorder: Recorder,
    mover: Mover,
    stopwatch: Stopwatch,
) -> Command:
    with stopwatch.measure("rays"):
        distances, hits_robot = scene.cast(robot, lidar)
    scan, pose = lidar.scan(stamp, distances), scene.pose(robot)
    recorder.add(scan, pose, hits_robot & scan.returned)
    return mover.decide(robot, scan, pose)
