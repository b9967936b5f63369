"""Simulate walls, robots and lidar beams in PyBullet. No other file imports PyBullet, and this one only on use."""

from __future__ import annotations

import importlib
import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from sim.physics.bodies import BODIES, RAY_HEIGHT, Command, VelocityBody
from sim.physics.drive import Drive
from sim.physics.robot import MAX_ROBOTS, RobotSettings
from sim.sensors.lidar import Lidar
from worlds.world import World

MAX_RAYS = 4095
"""Most rays in one call. Above its limit (4096 on macOS, 16384 elsewhere) PyBullet drops rays without an error."""

SHORT_REACH = 4.0
"""Length [m] of the first, cheap cast. The cost of a ray grows with its length, so only beams that hit nothing within
this length are cast again at full range."""

WALL_HEIGHT = 1.0
MESH_SIDES = 30_000
"""Most sides of walls in one mesh; Bullet refuses more than 131,072 vertices, four a side."""
_WALL_GROUP, _GROUND_GROUP = 1, 1 << 30
GRAVITY = -9.81
SOLVER_ITERATIONS = 20
"""Solver iterations for robots on wheels. Bullet's default of 50 takes twice the time without a visible difference."""


class BulletScene:
    """Hold the walls of a world as meshes, and robots as bodies of one drive.

    ``starts`` are the robots' world_from_base. ``robots`` are their settings: one per robot, or one for all. Use the
    scene as a context manager. Each scene has its own physics client, so equal calls give equal results. Time passes in
    ``advance`` only.

    Raises ``ValueError`` if there are more than 29 robots, ``ImportError`` if PyBullet is not installed.
    """

    def __init__(
        self,
        world: World,
        starts: Sequence[SE2],
        robots: RobotSettings | Sequence[RobotSettings] = RobotSettings(),  # noqa: B008 (frozen)
        drive: Drive = "velocity",
    ) -> None:
        if len(starts) > MAX_ROBOTS:
            raise ValueError(f"BulletScene: {len(starts)} robots, at most {MAX_ROBOTS} fit in one scene")
        self._world = world
        self._starts = tuple(starts)
        self._robots = [robots] * len(starts) if isinstance(robots, RobotSettings) else list(robots)
        self._drive: Drive = drive
        self._directions: dict[Lidar, NDArray[np.float64]] = {}

    def __enter__(self) -> BulletScene:
        self._bullet = _pybullet()
        self._client = self._bullet.connect(self._bullet.DIRECT)
        self._add_walls()
        if self._drive == "wheels":
            self._add_ground()
        self._bodies = [self._add_robot(index) for index in range(len(self._starts))]
        numbers = [body.number for body in self._bodies]
        self._is_robot = np.isin(np.arange(max(numbers, default=-1) + 2), numbers)  # at -1, the last: nothing met
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bullet.disconnect(physicsClientId=self._client)

    def _add_walls(self) -> None:
        """Add the walls as concave meshes, mostly one: 440,000 rays/s, against 156,000 with one box per wall."""
        sides = self._world.segments()
        for first in range(0, len(sides), MESH_SIDES):
            self._add_mesh(sides[first : first + MESH_SIDES])

    def _add_mesh(self, sides: NDArray[np.float64]) -> None:
        low = np.concatenate((sides, np.zeros((len(sides), 2, 1))), axis=2)
        high = np.concatenate((sides, np.full((len(sides), 2, 1), WALL_HEIGHT)), axis=2)
        vertices = np.concatenate((low, high), axis=1).reshape(-1, 3)
        triangles = 4 * np.arange(len(sides))[:, None] + np.array((0, 1, 3, 0, 3, 2))
        shape = self._bullet.createCollisionShape(
            self._bullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=triangles.ravel().tolist(),
            flags=self._bullet.GEOM_FORCE_CONCAVE_TRIMESH,
            physicsClientId=self._client,
        )
        body = self._bullet.createMultiBody(0.0, shape, physicsClientId=self._client)
        self._bullet.setCollisionFilterGroupMask(body, -1, _WALL_GROUP, -1, physicsClientId=self._client)
        self._bullet.changeDynamics(body, -1, lateralFriction=0.0, restitution=0.0, physicsClientId=self._client)

    def _add_ground(self) -> None:
        shape = self._bullet.createCollisionShape(self._bullet.GEOM_PLANE, physicsClientId=self._client)
        body = self._bullet.createMultiBody(0.0, shape, physicsClientId=self._client)
        self._bullet.setCollisionFilterGroupMask(body, -1, _GROUND_GROUP, -1, physicsClientId=self._client)
        self._bullet.changeDynamics(body, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=self._client)
        self._bullet.setGravity(0.0, 0.0, GRAVITY, physicsClientId=self._client)
        self._bullet.setPhysicsEngineParameter(numSolverIterations=SOLVER_ITERATIONS, physicsClientId=self._client)

    def _add_robot(self, index: int) -> VelocityBody:
        body = BODIES[self._drive](self._bullet, self._client, self._robots[index], self._starts[index])
        for link in range(-1, self._bullet.getNumJoints(body.number, physicsClientId=self._client)):
            self._bullet.setCollisionFilterGroupMask(body.number, link, 2 << index, -1, physicsClientId=self._client)
        return body

    def pose(self, robot: int) -> SE2:
        """Return world_from_base of one robot."""
        return self._bodies[robot].pose()

    def advance(self, commands: Sequence[Command], step: float, steps: int) -> NDArray[np.bool_]:
        """Drive each robot at its (forward speed [m/s], turn rate [rad/s]) for ``steps`` time steps of ``step`` [s].

        Returns a mask (robots,) of the robots that touched a wall or another robot meanwhile.
        """
        self._bullet.setTimeStep(step, physicsClientId=self._client)
        touched = np.zeros(len(self._bodies), dtype=np.bool_)
        for body, command in zip(self._bodies, commands, strict=True):
            body.drive(command)
        for _ in range(steps):
            for body in self._bodies:
                body.before_step(step)
            self._bullet.stepSimulation(physicsClientId=self._client)
            for robot, body in enumerate(self._bodies):
                touched[robot] |= body.in_contact()
        return touched

    def set_poses(self, poses: Sequence[SE2]) -> NDArray[np.bool_]:
        """Move each robot to its world_from_base. Returns a mask (robots,) of the robots in contact there."""
        for body, pose in zip(self._bodies, poses, strict=True):
            body.set_pose(pose)
        self._bullet.performCollisionDetection(physicsClientId=self._client)
        return np.array([body.in_contact() for body in self._bodies])

    def cast(self, robot: int, lidar: Lidar) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Cast the lidar's beams from one robot.

        Returns the distances (B,) [m], +inf for a miss, and a mask (B,) of the beams that end on another robot. The
        robot does not see itself. Beams end at the lidar's maximum range.
        """
        pose = self.pose(robot) @ lidar.base_from_lidar
        ahead, c, s = self._beams(lidar), math.cos(pose.yaw), math.sin(pose.yaw)
        start = np.array((pose.x, pose.y, RAY_HEIGHT))
        ways = np.zeros((lidar.beams, 3))
        ways[:, 0], ways[:, 1] = c * ahead[0] - s * ahead[1], s * ahead[0] + c * ahead[1]
        bodies, distances = self._hits(start, ways, min(SHORT_REACH, lidar.range_max), ignored=2 << robot)
        missing = (bodies < 0).nonzero()[0]
        if missing.size and lidar.range_max > SHORT_REACH:
            bodies[missing], distances[missing] = self._hits(start, ways[missing], lidar.range_max, ignored=2 << robot)
        return distances, self._is_robot[bodies]

    def _beams(self, lidar: Lidar) -> NDArray[np.float64]:
        """Return the beam directions (2, B) in the lidar's frame, cached per lidar."""
        if lidar not in self._directions:
            self._directions[lidar] = np.stack((np.cos(lidar.angles), np.sin(lidar.angles)))
        return self._directions[lidar]

    def rays(
        self, starts: NDArray[np.float64], ends: NDArray[np.float64], ignored: int = 0
    ) -> Sequence[tuple[int, int, float, tuple[float, float, float], tuple[float, float, float]]]:
        """Cast N rays from ``starts`` to ``ends``, (N, 3) each in the world, N at most ``MAX_RAYS``.

        Returns PyBullet's own hit records. Rays pass through bodies whose mask bits are in ``ignored``.
        """
        hits: Sequence[tuple[int, int, float, tuple[float, float, float], tuple[float, float, float]]]
        hits = self._bullet.rayTestBatch(
            starts, ends, numThreads=1, collisionFilterMask=~(ignored | _GROUND_GROUP), physicsClientId=self._client
        )
        return hits

    def _hits(
        self, start: NDArray[np.float64], ways: NDArray[np.float64], reach: float, ignored: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the first body (-1: none) and the distance [m] (+inf: none) along each ray direction (N, 3), (N,)
        each."""
        starts = np.empty_like(ways)
        starts[:] = start
        ends = start + reach * ways
        hits = list(self.rays(starts[:MAX_RAYS], ends[:MAX_RAYS], ignored))
        for first in range(MAX_RAYS, len(ways), MAX_RAYS):
            hits += self.rays(starts[first : first + MAX_RAYS], ends[first : first + MAX_RAYS], ignored)
        bodies = np.array([hit[0] for hit in hits])
        distances = reach * np.array([hit[2] for hit in hits])
        distances[bodies < 0] = math.inf
        return bodies, distances


def _pybullet() -> Any:
    try:
        with _quiet_stderr():
            return importlib.import_module("pybullet")
    except ImportError as error:
        raise ImportError(
            "simulating needs pybullet, which has no wheel after Python 3.11: run it on Python 3.11 with it installed"
        ) from error


@contextmanager
def _quiet_stderr() -> Iterator[None]:
    """Silence file descriptor 2, because PyBullet prints from C on import."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
