"""A simulated run as a stream of messages, as its robots would send them: maps that grow, scans, odometry, tf, clock.

/clock                     rosgraph_msgs/Clock at each scan
/tf_static                 base_link -> lidar of every robot
/tf                        odom -> base_link and map -> odom, at the stamp of each scan
/NAME/odom, /NAME/scan     as in the bag that ``mapquilt convert`` writes, and /NAME/ground_truth
/NAME/map                  nav_msgs/OccupancyGrid every period, in the frame of the robot's start

No robot knows where the others start: ``NAME/map`` has no parent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rosbags.typesys.stores import ros2_humble as ros

from mapping.grid.log_odds import LogOddsMapper
from mapping.robot.trajectory import Trajectory
from mapping.slam.front_end import FRONT_ENDS
from mapping.slam.settings import SlamSettings
from mapquilt.convert.ros_bag import mounting, scan_messages
from mapquilt.convert.ros_messages import occupancy_grid, ros_nanoseconds, transform
from mapquilt.runs.robot import RunRobot

Sent = tuple[str, Any, int]
"""Topic, message and time [ns]."""


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
    robots: Sequence[RunRobot], poses: Sequence[Trajectory], period: float = 2.0, resolution: float = 0.05
) -> Iterator[Sent]:
    """Yield the messages of a team in the order of their time, each robot's map every ``period`` [s] and at its end.

    ``poses`` are ``map_from_base`` of each robot, one for each scan.
    """
    moments = sorted(
        (ros_nanoseconds(scan.stamp), index, k)
        for index, robot in enumerate(robots)
        for k, scan in enumerate(robot.log.scans)
    )
    mappers = [LogOddsMapper(resolution) for _ in robots]
    due = [robot.log.scans[0].stamp + period for robot in robots]
    yield "/tf_static", ros.tf2_msgs__msg__TFMessage([mounting(robot) for robot in robots]), moments[0][0]
    last = -1
    for nanoseconds, index, k in moments:
        robot, scan = robots[index], robots[index].log.scans[k]
        if nanoseconds > last:
            last = nanoseconds
            seconds, rest = divmod(nanoseconds, 1_000_000_000)
            yield "/clock", ros.rosgraph_msgs__msg__Clock(ros.builtin_interfaces__msg__Time(seconds, rest)), nanoseconds
        map_from_base = poses[index].pose(k)
        map_from_odom = map_from_base @ robot.log.odometry.pose(k).inverse()
        placed = transform(scan.stamp, map_from_odom, f"{robot.name}/map", f"{robot.name}/odom")
        yield "/tf", ros.tf2_msgs__msg__TFMessage([placed]), nanoseconds
        for topic, message in scan_messages(robot, k):
            yield topic, message, nanoseconds
        mappers[index].integrate(scan, map_from_base @ robot.log.base_from_lidar)
        if scan.stamp >= due[index] or k == len(robot.log.scans) - 1:
            due[index] += period
            grid = occupancy_grid(mappers[index].grid(), scan.stamp, f"{robot.name}/map")
            yield f"/{robot.name}/map", grid, nanoseconds
