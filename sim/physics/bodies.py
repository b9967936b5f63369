"""Build robots as physics bodies, command them, and read their poses.

``bullet`` is the module that :mod:`sim.physics.bullet` imports, ``client`` its physics client.
"""

from __future__ import annotations

import math
from typing import Any

from mapping.geometry.se2 import SE2
from sim.physics.drive import Drive
from sim.physics.robot import RobotSettings

RAY_HEIGHT = 0.5
BODY_HEIGHT = 0.6
MASS = 10.0
WHEEL_TRACK, WHEEL_RADIUS, CASTER_RADIUS = 1.3, 0.35, 0.15
"""Distance between the wheels, wheel radius and caster radius, each as a multiple of the robot's radius."""
WHEEL_FRICTION = 0.9
MOTOR_FORCE = 40.0
"""Greatest force of a wheel motor [N] per m/s^2 of the acceleration limit, or per 1 m/s^2 if the limit is lower. It is
enough to follow the limits against friction, and too little to push walls."""

Command = tuple[float, float]
"""Forward speed [m/s] and turn rate [rad/s]."""


class VelocityBody:
    """Move an upright cylinder whose planar velocity is set before each step; walls and other bodies stop it."""

    def __init__(self, bullet: Any, client: int, robot: RobotSettings, start: SE2) -> None:
        self._bullet, self._client, self._limits = bullet, client, robot.limits
        self._target: Command = (0.0, 0.0)
        self._velocity: Command = (0.0, 0.0)
        self.number = self._build(robot, start)

    def _build(self, robot: RobotSettings, start: SE2) -> int:
        shape = self._bullet.createCollisionShape(
            self._bullet.GEOM_CYLINDER, radius=robot.radius, height=BODY_HEIGHT, physicsClientId=self._client
        )
        number = self._bullet.createMultiBody(
            MASS,
            shape,
            basePosition=(start.x, start.y, RAY_HEIGHT),
            baseOrientation=quaternion(start.yaw),
            physicsClientId=self._client,
        )
        # A zero moment of inertia stands for an infinite one in Bullet: the body cannot roll or pitch.
        self._bullet.changeDynamics(
            number,
            -1,
            localInertiaDiagonal=(0.0, 0.0, 0.2),
            lateralFriction=0.0,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self._client,
        )
        return int(number)

    def drive(self, command: Command) -> None:
        """Set the command to follow from now on."""
        self._target = command

    def before_step(self, seconds: float) -> None:
        """Apply the command to the physics for the coming step of ``seconds``."""
        if self._velocity != self._target:
            self._velocity = self._limits.ramp(self._velocity, self._target, seconds)
        speed, turn_rate = self._velocity
        _, (_, _, z, w) = self._bullet.getBasePositionAndOrientation(self.number, physicsClientId=self._client)
        yaw = 2.0 * math.atan2(z, w)
        self._bullet.resetBaseVelocity(
            self.number,
            (speed * math.cos(yaw), speed * math.sin(yaw), 0.0),
            (0.0, 0.0, turn_rate),
            physicsClientId=self._client,
        )

    def set_pose(self, pose: SE2) -> None:
        """Move the body to world_from_base, even into contact with other bodies."""
        position = (pose.x, pose.y, RAY_HEIGHT)
        self._bullet.resetBasePositionAndOrientation(
            self.number, position, quaternion(pose.yaw), physicsClientId=self._client
        )

    def pose(self) -> SE2:
        """Return world_from_base."""
        (x, y, _), (_, _, z, w) = self._bullet.getBasePositionAndOrientation(self.number, physicsClientId=self._client)
        return SE2(x, y, 2.0 * math.atan2(z, w))

    def in_contact(self) -> bool:
        """Return whether the hull touches a wall or another robot."""
        contacts = self._bullet.getContactPoints(bodyA=self.number, linkIndexA=-1, physicsClientId=self._client)
        return any(contact[8] <= 0.0 for contact in contacts)


class WheeledBody(VelocityBody):
    """Move a cylindrical hull on two driven wheels and two frictionless casters.

    The grip of the wheels moves the robot, so it slips when it accelerates, turns or pushes. The base frame lies on the
    axle.
    """

    def _build(self, robot: RobotSettings, start: SE2) -> int:
        self._wheel, self._half_track = WHEEL_RADIUS * robot.radius, WHEEL_TRACK * robot.radius / 2.0
        caster = CASTER_RADIUS * robot.radius
        hull_middle = caster + BODY_HEIGHT / 2.0 - self._wheel
        shapes = [
            self._shape("GEOM_CYLINDER", radius=self._wheel, height=0.15 * robot.radius),
            self._shape("GEOM_SPHERE", radius=caster),
        ]
        upright, lying = (0.0, 0.0, 0.0, 1.0), (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
        axle, below = self._half_track, caster - self._wheel + 0.001
        hinge, fixed = self._bullet.JOINT_REVOLUTE, self._bullet.JOINT_FIXED
        number = self._bullet.createMultiBody(
            MASS,
            self._shape(
                "GEOM_CYLINDER",
                radius=robot.radius,
                height=BODY_HEIGHT,
                collisionFramePosition=(0.0, 0.0, hull_middle),
            ),
            basePosition=(start.x, start.y, self._wheel),
            baseOrientation=quaternion(start.yaw),
            linkMasses=[0.5, 0.5, 0.1, 0.1],
            linkCollisionShapeIndices=[shapes[0], shapes[0], shapes[1], shapes[1]],
            linkVisualShapeIndices=[-1] * 4,
            linkPositions=[
                (0.0, axle, 0.0),
                (0.0, -axle, 0.0),
                (0.75 * robot.radius, 0.0, below),
                (-0.75 * robot.radius, 0.0, below),
            ],
            linkOrientations=[lying, lying, upright, upright],
            linkInertialFramePositions=[(0.0, 0.0, 0.0)] * 4,
            linkInertialFrameOrientations=[upright] * 4,
            linkParentIndices=[0] * 4,
            linkJointTypes=[hinge, hinge, fixed, fixed],
            linkJointAxis=[(0.0, 0.0, 1.0)] * 4,
            physicsClientId=self._client,
        )
        for link, friction in ((-1, 0.0), (0, WHEEL_FRICTION), (1, WHEEL_FRICTION), (2, 0.0), (3, 0.0)):
            self._bullet.changeDynamics(
                number, link, lateralFriction=friction, restitution=0.0, physicsClientId=self._client
            )
        return int(number)

    def _shape(self, kind: str, **dimensions: Any) -> int:
        made = self._bullet.createCollisionShape(
            getattr(self._bullet, kind), **dimensions, physicsClientId=self._client
        )
        return int(made)

    def before_step(self, seconds: float) -> None:
        if self._velocity == self._target:
            return
        self._velocity = self._limits.ramp(self._velocity, self._target, seconds)
        speed, turn = self._velocity[0], self._velocity[1] * self._half_track
        torque = MOTOR_FORCE * max(1.0, self._limits.acceleration) * self._wheel
        self._bullet.setJointMotorControlArray(
            self.number,
            (0, 1),
            self._bullet.VELOCITY_CONTROL,
            targetVelocities=((speed - turn) / self._wheel, (speed + turn) / self._wheel),
            forces=(torque, torque),
            physicsClientId=self._client,
        )

    def pose(self) -> SE2:
        (x, y, _), (qx, qy, qz, qw) = self._bullet.getBasePositionAndOrientation(
            self.number, physicsClientId=self._client
        )
        return SE2(x, y, math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz)))


BODIES: dict[Drive, type[VelocityBody]] = {"velocity": VelocityBody, "wheels": WheeledBody}
"""Body class of each drive."""


def quaternion(yaw: float) -> tuple[float, float, float, float]:
    """Convert ``yaw`` [rad] to a quaternion (x, y, z, w)."""
    return 0.0, 0.0, math.sin(yaw / 2.0), math.cos(yaw / 2.0)
