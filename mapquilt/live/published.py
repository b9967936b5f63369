"""Messages that a live merge publishes.

/map_merged              nav_msgs/OccupancyGrid, latched
/mapquilt/conflicts      nav_msgs/OccupancyGrid, latched: where the maps contradict one another
/tf_static               merged frame -> map frame of the robot that holds it, which never changes
/tf                      merged frame -> map frame of every other robot that is joined
/mapquilt/diagnostics    diagnostic_msgs/DiagnosticArray: the whole, each robot's state and pair's verdict, with reasons
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rosbags.typesys.stores import ros2_humble as ros

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.wording import counted
from mapquilt.convert.ros_messages import BAG_START, occupancy_grid, transform
from mapquilt.live.live_merger import LiveState
from mapquilt.live.placement import State
from mapquilt.live.settings import LiveSettings
from mapquilt.live.topics import Names

OK, WARN, ERROR, STALE = 0, 1, 2, 3
"""Levels of diagnostic_msgs/DiagnosticStatus."""


def published(
    state: LiveState,
    now: float,
    names: Names = Names(),
    settings: LiveSettings = LiveSettings(),
    *,
    with_maps: bool = True,
    frozen: bool = False,
) -> Iterator[tuple[str, Any]]:
    """Yield topic and message of all that is published at ``now`` [s] of ROS time, ``with_maps`` or without."""
    stamp = now - BAG_START  # which the messages add
    frames = map_frames(state)
    for held, topic in ((True, "/tf_static"), (False, "/tf")):
        transforms = [
            transform(stamp, SE2(pose.x, pose.y, pose.yaw), names.frame, frames[name])
            for name, pose in state.poses.items()
            if state.placements[name].holds_frame is held
        ]
        if transforms:
            yield topic, ros.tf2_msgs__msg__TFMessage(transforms)
    if with_maps and state.fused is not None:
        yield names.topic, occupancy_grid(state.fused.merged, stamp, names.frame)
        yield names.conflicts, occupancy_grid(state.fused.conflicts, stamp, names.frame)
    yield names.diagnostics, diagnostics(state, now, settings, frozen)


def map_frames(state: LiveState) -> dict[str, str]:
    """Return the map frame of each robot. Frames that several robots have, such as ``map``, get the robot's name."""
    frames = {name: robot.message.frame if robot.message else "" for name, robot in state.robots.items()}
    several = {frame for frame in frames.values() if list(frames.values()).count(frame) > 1 or not frame}
    return {name: f"{name}/{frame or 'map'}" if frame in several else frame for name, frame in frames.items()}


def diagnostics(
    state: LiveState, now: float, settings: LiveSettings, frozen: bool = False
) -> ros.diagnostic_msgs__msg__DiagnosticArray:
    """Build the diagnostics: a status of the whole, of each robot and of each pair."""
    joined, robots = len(state.poses), len(state.robots)
    whole = f"{joined} of {counted(robots, 'robot')} joined{', frozen' if frozen else ''}"
    values = {"joined": str(joined), "robots": str(robots), "updates": str(state.turn), "frozen": str(frozen).lower()}
    statuses = [_status(OK if robots and joined == robots else WARN, "mapquilt: merged map", whole, values)]
    for name, robot in state.robots.items():
        placement = state.placements[name]
        silent = robot.is_silent(now, settings)
        level = ERROR if robot.fault else STALE if silent else OK if placement.state is State.JOINED else WARN
        spoken = f"silent for {now - robot.heard:.0f} s" if silent else placement.reason or placement.state.value
        values = {
            "state": placement.state.value,
            "known_cells": str(robot.known_cells),
            "age_s": f"{now - robot.heard:.1f}",
            "restarts": str(robot.life),
            **_pose_values(placement.published),
        }
        statuses.append(_status(level, f"mapquilt: {name}", robot.fault or spoken, values))
    for (target, source), entry in state.pairs.items():
        answer = entry.answer
        values = {
            "confidence": f"{answer.confidence:.3f}",
            "verdict": "accepted" if answer.accepted else "refused",
            **_pose_values(answer.target_from_source),
        }
        message = "accepted" if answer.accepted else f"refused: {answer.reason_text}"
        statuses.append(_status(OK if answer.accepted else WARN, f"mapquilt: {target} <- {source}", message, values))
    seconds, rest = divmod(round(now * 1e9), 1_000_000_000)
    header = ros.std_msgs__msg__Header(stamp=ros.builtin_interfaces__msg__Time(seconds, rest), frame_id="")
    return ros.diagnostic_msgs__msg__DiagnosticArray(header=header, status=statuses)


def _pose_values(pose: Similarity2 | None) -> dict[str, str]:
    if pose is None:
        return {}
    return {"x_m": f"{pose.x:.3f}", "y_m": f"{pose.y:.3f}", "yaw_deg": f"{math.degrees(pose.yaw):.2f}"}


def _status(level: int, name: str, message: str, values: Mapping[str, str]) -> Any:
    pairs = [ros.diagnostic_msgs__msg__KeyValue(key, value) for key, value in values.items()]
    return ros.diagnostic_msgs__msg__DiagnosticStatus(
        level=level, name=name, message=message, hardware_id="", values=pairs
    )
