"""Replay given trajectories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory
from sim.mission.settings import MissionSettings
from sim.physics.bodies import Command
from sim.physics.stopwatch import Stopwatch
from worlds.world import World

if TYPE_CHECKING:
    from sim.physics.bullet import BulletScene

STEP = 0.1
"""Spacing of the checked positions between two poses [m]."""


class Replayed:
    """Set the bodies to the poses of given world_from_base trajectories. Beyond their ends, robots stand still."""

    def __init__(self, scene: BulletScene, paths: Sequence[Trajectory], stopwatch: Stopwatch) -> None:
        self._scene, self._stopwatch = scene, stopwatch
        self._stamps = [path.stamps - path.stamps[0] for path in paths]
        self._poses = [np.column_stack((path.poses[:, :2], np.unwrap(path.poses[:, 2]))) for path in paths]

    def advance(self, start: float, seconds: float, commands: Sequence[Command]) -> NDArray[np.bool_]:
        """Set the bodies to their poses at the end of the period."""
        with self._stopwatch.measure("physics"):
            return self._scene.set_poses([self._pose(robot, start + seconds) for robot in range(len(self._poses))])

    def decide(self, robot: int, scan: LidarScan, world_from_base: SE2) -> Command:
        """Return no command: the trajectory decides."""
        return 0.0, 0.0

    def _pose(self, robot: int, time: float) -> SE2:
        stamps, poses = self._stamps[robot], self._poses[robot]
        x, y, yaw = (float(np.interp(time, stamps, poses[:, axis])) for axis in range(3))
        return SE2(x, y, math.remainder(yaw, math.tau))


def check_replay(world: World, settings: MissionSettings, paths: Sequence[Trajectory]) -> None:
    """Check that there is one trajectory per robot, and that each stays on free floor.

    Raises ``ValueError`` with the time and the position of the first fault.
    """
    if (settings.policy == "replay") != bool(paths):
        raise ValueError(f"replay holds {len(paths)} trajectories, but the policy is {settings.policy}")
    if paths and len(paths) != len(settings.robots):
        raise ValueError(
            f"replay holds {len(paths)} trajectories, must hold one for each of {len(settings.robots)} robots"
        )
    for index, path in enumerate(paths):
        poses = np.column_stack((path.stamps, path.poses[:, :2]))
        _require_free(world, index, poses)
        _require_free(world, index, _with_places_between(poses))


def _with_places_between(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolate rows of time [s], x, y [m] (N, 3) at most 0.1 m apart."""
    pieces = np.maximum(1, np.ceil(np.hypot(*np.diff(poses[:, 1:], axis=0).T) / STEP)).astype(np.int64)
    at = np.concatenate([*(k + np.arange(count) / count for k, count in enumerate(pieces)), [len(pieces)]])
    return np.stack([np.interp(at, np.arange(len(poses)), column) for column in poses.T], axis=-1)


def _require_free(world: World, index: int, places: NDArray[np.float64]) -> None:
    within = ((places[:, 1:] >= 0.0) & (places[:, 1:] <= world.size)).all(axis=1)
    blocked = np.flatnonzero(~within | (world.clearance(places[:, 1:]) <= 0.0))
    if blocked.size:
        stamp, x, y = places[blocked[0]]
        raise ValueError(
            f"replay of robot_{index}: at {stamp:g} s, ({x:g}, {y:g}), it is {world.fault_at(float(x), float(y))}"
        )
