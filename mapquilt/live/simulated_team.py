"""A simulated run as a stream of messages, as its robots would send them: maps that grow, scans, odometry, tf, clock.

/clock                     rosgraph_msgs/Clock at each scan
/tf_static                 base_link -> lidar of every robot
/tf                        odom -> base_link and map -> odom, at the stamp of each scan
/NAME/odom, /NAME/scan     as in the bag that ``mapquilt convert`` writes, and /NAME/ground_truth
/NAME/map                  nav_msgs/OccupancyGrid every period, in the frame of the robot's start

No robot knows where the others start: ``NAME/map`` has no parent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.stores import ros2_humble as ros

from mapping.geometry.se2 import SE2
from mapping.grid.log_odds import LogOddsMapper
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.robot.trajectory import Trajectory
from mapping.slam.front_end import FRONT_ENDS
from mapping.slam.pipeline import online_poses
from mapping.slam.settings import SlamSettings
from mapquilt.convert.ros_bag import mounting, scan_messages
from mapquilt.convert.ros_messages import occupancy_grid, ros_nanoseconds, transform
from mapquilt.runs.robot import RunRobot

Sent = tuple[str, Any, int]
"""Topic, message and time [ns]."""


PoseSource = Trajectory | Iterable[NDArray[np.float64]]
"""Poses of a robot's scans: known from the start, or those of all scans so far, (k + 1, 3), after each scan k."""

ONLINE = "online"
"""Poses as SLAM has them at the time of each map: a loop that closes moves what was drawn before."""


def pose_sources(
    robots: Sequence[RunRobot], poses: str, on_robot: Callable[[int, int], None] = lambda done, total: None
) -> tuple[PoseSource, ...]:
    """Return the poses of each robot: those of a front end for the whole log, or ``ONLINE``."""
    if poses == ONLINE:
        return tuple(online_poses(robot.log) for robot in robots)
    return start_poses(robots, poses, on_robot)


def start_poses(
    robots: Sequence[RunRobot], front_end: str = "slam", on_robot: Callable[[int, int], None] = lambda done, total: None
) -> tuple[Trajectory, ...]:
    """Estimate the poses ``map_from_base`` that each robot maps with; ``on_robot`` gets those done and their number."""
    found = []
    for robot in robots:
        found.append(FRONT_ENDS[front_end](robot.log, SlamSettings(), lambda scans: None).trajectory)
        on_robot(len(found), len(robots))
    return tuple(found)


def team_messages(
    robots: Sequence[RunRobot], poses: Sequence[PoseSource], period: float = 2.0, resolution: float = 0.05
) -> Iterator[Sent]:
    """Yield the messages of a team in the order of their time, each robot's map every ``period`` [s] and at its end.

    ``poses`` are ``map_from_base`` of each robot.
    """
    moments = sorted(
        (ros_nanoseconds(scan.stamp), index, k)
        for index, robot in enumerate(robots)
        for k, scan in enumerate(robot.log.scans)
    )
    maps = [_GrowingMap(robot, source, resolution) for robot, source in zip(robots, poses, strict=True)]
    due = [robot.log.scans[0].stamp + period for robot in robots]
    yield "/tf_static", ros.tf2_msgs__msg__TFMessage([mounting(robot) for robot in robots]), moments[0][0]
    last = -1
    for nanoseconds, index, k in moments:
        robot, scan = robots[index], robots[index].log.scans[k]
        if nanoseconds > last:
            last = nanoseconds
            seconds, rest = divmod(nanoseconds, 1_000_000_000)
            yield "/clock", ros.rosgraph_msgs__msg__Clock(ros.builtin_interfaces__msg__Time(seconds, rest)), nanoseconds
        map_from_odom = maps[index].next_pose() @ robot.log.odometry.pose(k).inverse()
        placed = transform(scan.stamp, map_from_odom, f"{robot.name}/map", f"{robot.name}/odom")
        yield "/tf", ros.tf2_msgs__msg__TFMessage([placed]), nanoseconds
        for topic, message in scan_messages(robot, k):
            yield topic, message, nanoseconds
        if scan.stamp >= due[index] or k == len(robot.log.scans) - 1:
            due[index] += period
            yield f"/{robot.name}/map", occupancy_grid(maps[index].grid(), scan.stamp, f"{robot.name}/map"), nanoseconds


class _GrowingMap:
    """Map of one robot, which is drawn anew when SLAM has moved a pose by more than ``tolerance`` [m or rad]."""

    def __init__(self, robot: RunRobot, source: PoseSource, resolution: float, tolerance: float = 1e-4) -> None:
        self._log, self._resolution, self._tolerance = robot.log, resolution, tolerance
        self._source = _poses_so_far(source) if isinstance(source, Trajectory) else iter(source)
        self._poses = self._drawn = np.empty((0, 3))
        self._mapper = LogOddsMapper(resolution)

    def next_pose(self) -> SE2:
        """Return the pose of the next scan."""
        self._poses = next(self._source)
        return SE2(*self._poses[-1].tolist())

    def grid(self) -> OccupancyGrid:
        """Draw the scans so far."""
        done = len(self._drawn)
        if np.abs(self._poses[:done] - self._drawn).max(initial=0.0) > self._tolerance:
            self._mapper, done = LogOddsMapper(self._resolution), 0
        for scan, pose in zip(self._log.scans[done:], self._poses[done:], strict=False):
            self._mapper.integrate(scan, SE2(*pose.tolist()) @ self._log.base_from_lidar)
        self._drawn = np.concatenate((self._drawn[:done], self._poses[done:]))
        return self._mapper.grid()


def _poses_so_far(trajectory: Trajectory) -> Iterator[NDArray[np.float64]]:
    return (trajectory.poses[: k + 1] for k in range(len(trajectory)))
