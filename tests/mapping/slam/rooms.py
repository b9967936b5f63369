"""Worlds of straight walls, the scans that an ideal lidar takes in them, and paths through them."""

from __future__ import annotations

import itertools
import math

import numpy as np

from mapping.geometry.se2 import SE2
from mapping.robot.robot_log import RobotLog
from mapping.robot.scan import LidarScan
from mapping.robot.trajectory import Trajectory

RANGE_MAX = 12.0


def box(x0, y0, x1, y1):
    """Return the four walls of a rectangle, (4, 4) rows of x, y, x, y."""
    return np.array([(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)], float)


def ring_corridor(side=16.0, width=2.0):
    """Return a square corridor around a block, with a niche that makes its sides differ."""
    niche = box(3.0, side - 0.5, 4.5, side)[:3]
    return np.vstack((box(0, 0, side, side), box(width, width, side - width, side - width), niche))


def office():
    """Return a room of 8 m x 6 m with two boxes in it."""
    return np.vstack((box(-1, -1, 7, 5), box(2, 3, 3, 4), box(5, 0, 5.5, 1)))


def cast(walls, pose, beams=360, range_max=RANGE_MAX):
    """Return exact ranges (beams,) of a lidar at a pose (3,): a slow oracle, beam by beam and wall by wall."""
    angles = pose[2] - math.pi + math.tau / beams * np.arange(beams)
    dx, dy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ax, ay, bx, by = walls.T
    ex, ey = bx - ax, by - ay
    across = dx * ey - dy * ex
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ((ax - pose[0]) * ey - (ay - pose[1]) * ex) / across
        share = ((ax - pose[0]) * dy - (ay - pose[1]) * dx) / across
    hit = (along > 1e-9) & (share >= 0.0) & (share <= 1.0)
    ranges = np.where(hit, along, np.inf).min(axis=1)
    return np.where(ranges <= range_max, ranges, np.inf)


def log_of(walls, poses, *, noise=0.0, odometry_noise=0.0, seed=0, beams=360, dt=0.1):
    """Return the log of a robot at poses (N, 3), and its true trajectory."""
    rng = np.random.default_rng(seed)
    stamps = dt * np.arange(len(poses))
    scans = []
    for stamp, pose in zip(stamps.tolist(), poses, strict=True):
        ranges = cast(walls, pose, beams)
        ranges = np.where(np.isfinite(ranges), ranges + noise * rng.standard_normal(beams), np.inf)
        ranges = np.clip(ranges, 0.01, None)
        ranges[ranges > RANGE_MAX] = np.inf
        scans.append(LidarScan(stamp, -math.pi, math.tau / beams, 0.0, RANGE_MAX, ranges.astype(np.float32)))
    true = Trajectory(stamps, poses)
    return RobotLog(tuple(scans), noisy(true.from_start(), odometry_noise, rng), SE2()), true


def noisy(path, level, rng):
    """Add independent errors to each step: ``level`` times 2 % of its length and 0.3 degrees a step that turns."""
    poses = [path.pose(0)]
    for k in range(1, len(path)):
        step = path.pose(k - 1).inverse() @ path.pose(k)
        length = math.hypot(step.x, step.y)
        stretch = 1.0 + level * 0.02 * rng.standard_normal()
        turn = level * (0.01 * math.sqrt(length) + 0.02 * abs(step.yaw)) * rng.standard_normal()
        poses.append(poses[-1] @ SE2(step.x * stretch, step.y * stretch, step.yaw + turn))
    return Trajectory(path.stamps, np.array([(pose.x, pose.y, pose.yaw) for pose in poses]))


def along(corners, speed=0.05, turn=0.1):
    """Return poses (N, 3) along straight lines between corners (K, 2), turning on the spot at each."""
    poses, yaw = [], math.atan2(*(corners[1] - corners[0])[::-1])
    for a, b in itertools.pairwise(corners):
        heading = math.atan2(*(b - a)[::-1])
        off = math.remainder(heading - yaw, math.tau)
        poses.extend((*a, yaw + math.copysign(k * turn, off)) for k in range(1, int(abs(off) / turn) + 1))
        yaw = heading
        steps = max(1, int(math.hypot(*(b - a)) / speed))
        poses.extend((*(a + (b - a) * k / steps), yaw) for k in range(steps))
    return np.array(poses)


def path_error(estimated, true):
    """Return the RMSE of positions [m] after the best rigid alignment, by a brute-force oracle over the rotation."""
    a = estimated.poses[:, :2] - estimated.poses[:, :2].mean(axis=0)
    b = true.poses[:, :2] - true.poses[:, :2].mean(axis=0)
    best = (math.inf, 0.0)
    for reach in (math.pi, 0.02, 0.0002):
        yaws = best[1] + np.linspace(-reach, reach, 721)
        best = min((math.sqrt(float(((SE2(yaw=yaw).apply(a) - b) ** 2).sum(axis=1).mean())), yaw) for yaw in yaws)
    return best[0]
