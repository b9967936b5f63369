"""SLAM: from a robot's log to its trajectory and pose graph.

1. Track: match each scan to the surfels of the latest keyframes (``tracking``).
2. Close loops: find places seen before, register sub-maps, optimise the pose graph (``loops``, ``graph.pose_graph``).
3. Adjust keyframes and walls together (``graph.adjustment``).
4. Register every scan to the walls of the finished map.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.trajectory import Trajectory
from mapping.slam.graph.adjustment import adjust, moved_scans, moved_with_nodes
from mapping.slam.loops.closure import KeyframeGraph
from mapping.slam.result import JointSlamResult, SlamResult
from mapping.slam.settings import SlamSettings
from mapping.slam.tracking.matching import match_scan
from mapping.slam.tracking.surfels import SurfelMap
from mapping.slam.tracking.tracker import Tracker

DEFAULTS = SlamSettings()


def slam(
    log: RobotLog, settings: SlamSettings = DEFAULTS, on_scan: Callable[[int], None] = lambda _: None
) -> SlamResult:
    """Estimate the trajectory of a log; equal logs and settings give equal results to the bit.

    ``on_scan`` gets the number of scans tracked so far.
    """
    joint = slam_together([(log, SE2.identity())], settings, on_scan)
    return SlamResult(joint.trajectories[0], joint.keyframes, joint.edges, joint.timings)


def slam_together(
    robots: Sequence[tuple[RobotLog, SE2]],
    settings: SlamSettings = DEFAULTS,
    on_scan: Callable[[int], None] = lambda _: None,
) -> JointSlamResult:
    """Estimate the trajectories of several robots in one pose graph; equal inputs give equal results to the bit.

    Each log comes with the rough pose of its start in the frame of the first one's. Loops link the robots where they
    saw the same place (multi-session SLAM, as in McDonald et al. 2013). ``on_scan`` gets the number of scans tracked so
    far, of all logs.
    """
    clock = _Clock()
    tracker = Tracker([log for log, _ in robots], settings)
    graph = KeyframeGraph(tracker, settings)
    begins = dict(zip(tracker.starts[1:-1].tolist(), (start for _, start in robots[1:]), strict=True))
    for index in range(int(tracker.starts[-1])):
        if index in begins:
            start = begins[index]
            graph.begin(index, np.array([start.x, start.y, start.yaw]))
            on_scan(index + 1)
            continue
        is_keyframe = tracker.add(index)
        clock.add("tracking")
        if is_keyframe:
            graph.add_keyframe()
            clock.add("loops")
        on_scan(index + 1)
    graph.solve()
    clock.add("loops")
    poses, surfels = adjust(tracker, graph.poses, settings)
    clock.add("adjustment")
    scans = _registered(tracker, moved_scans(tracker, poses), surfels, settings)
    clock.add("registration")
    loops = [loop.link.edge(loop.evidence) for loop in graph.loops]
    whole, bounds = SE2(*scans[0]).inverse(), tracker.starts.tolist()
    return JointSlamResult(
        trajectories=tuple(
            Trajectory(log.odometry.stamps, scans[first:stop]).moved(whole)
            for (log, _), (first, stop) in zip(robots, itertools.pairwise(bounds), strict=True)
        ),
        keyframes=np.array([keyframe.scan for keyframe in tracker.track.keyframes]),
        edges=(*(link.edge() for link in tracker.track.links), *loops),
        timings=MappingProxyType(clock.seconds),
    )


def online_poses(log: RobotLog, settings: SlamSettings = DEFAULTS) -> Iterator[NDArray[np.float64]]:
    """Yield after each scan the poses ``start_from_base`` of all scans so far, (k + 1, 3), as SLAM has them then.

    A loop that closes moves earlier poses. ``slam`` improves the last of these once more, by steps 3 and 4.
    """
    tracker = Tracker([log], settings)
    graph = KeyframeGraph(tracker, settings)
    nodes: list[int] = []
    for index in range(len(log.scans)):
        if tracker.add(index):
            graph.add_keyframe()
            nodes.append(index)
        yield moved_with_nodes(tracker.track.poses[: index + 1], np.array(nodes), graph.poses)


class _Clock:
    """Add up the processor time of each step [s]."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.process_time()

    def add(self, step: str) -> None:
        now = time.process_time()
        self.seconds[step] = self.seconds.get(step, 0.0) + now - self._last
        self._last = now


def _registered(
    tracker: Tracker, poses: NDArray[np.float64], surfels: SurfelMap | None, settings: SlamSettings
) -> NDArray[np.float64]:
    """Register each scan to the surfels of the whole map, near its pose (N, 3)."""
    deviation, yaw = settings.adjustment.scan_deviation, settings.adjustment.scan_yaw_deviation
    prior = np.diag(1.0 / np.square([deviation, deviation, yaw]))
    return np.stack(
        [
            match_scan(tracker.points_of(index), surfels, pose, (pose, prior), settings.match).pose
            for index, pose in enumerate(poses)
        ]
    )
