"""Simulate candidate motions and choose the best, compiled with numba."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def roll_out(
    fan: NDArray[np.float64],
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
    radius: float,
    near: NDArray[np.float64],
    drifts: NDArray[np.float64],
    horizon: float,
    steps: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Simulate each motion of ``fan`` (M, 2), forward speed [m/s] and turn rate [rad/s], from the present ``velocity``,
    over ``horizon`` [s] in ``steps``.

    Points ``near`` (N, 2) in base [m] move at ``drifts`` (N, 2) [m/s]. Speeds change at most by ``acceleration``.
    Returns clearances (M, 3) [m] (the least, the last, and the least if all points stood still), and end poses (M, 3)
    in base.
    """
    rooms, ends = np.empty((fan.shape[0], 3)), np.empty((fan.shape[0], 3))
    dt = horizon / steps
    most_speed, most_turn = acceleration[0] * dt, acceleration[1] * dt
    for m in range(fan.shape[0]):
        speed, turn = velocity
        x, y, yaw = 0.0, 0.0, 0.0
        least, room, still = math.inf, math.inf, math.inf
        for step in range(1, steps + 1):
            speed += max(-most_speed, min(most_speed, fan[m, 0] - speed))
            turn += max(-most_turn, min(most_turn, fan[m, 1] - turn))
            x += speed * dt * math.cos(yaw + turn * dt / 2.0)
            y += speed * dt * math.sin(yaw + turn * dt / 2.0)
            yaw += turn * dt
            squared, squared_still = math.inf, math.inf
            for k in range(near.shape[0]):
                dx, dy = near[k, 0] - x, near[k, 1] - y
                squared_still = min(squared_still, dx * dx + dy * dy)
                dx, dy = dx + drifts[k, 0] * step * dt, dy + drifts[k, 1] * step * dt
                squared = min(squared, dx * dx + dy * dy)
            room = math.sqrt(squared) - radius
            least, still = min(least, room), min(still, math.sqrt(squared_still) - radius)
        rooms[m, 0], rooms[m, 1], rooms[m, 2] = least, room, still
        ends[m, 0], ends[m, 1], ends[m, 2] = x, y, yaw
    return rooms, ends


@njit(cache=True)
def best_motion(
    fan: NDArray[np.float64],
    rooms: NDArray[np.float64],
    ends: NDArray[np.float64],
    target: NDArray[np.float64],
    margin: float,
    comfort: float,
) -> int:
    """Return the index of the motion that ends best for a ``target`` (2,) in base [m].

    Of the motions that keep the ``margin`` [m], the best ends near the target, faces it and keeps the clearance
    ``comfort`` [m]. If none keeps the margin, the one that keeps or gains the most clearance is chosen, if possible
    among those that keep the margin to the present positions of all points.
    """
    best, least_cost = -1, math.inf
    for m in range(fan.shape[0]):
        if rooms[m, 0] < margin:
            continue
        dx, dy = target[0] - ends[m, 0], target[1] - ends[m, 1]
        distance = math.hypot(dx, dy)
        bearing = math.atan2(dy, dx) - ends[m, 2]
        off = abs(math.atan2(math.sin(bearing), math.cos(bearing))) * min(1.0, distance / 0.3)
        tight = max(0.0, comfort - rooms[m, 0]) / comfort
        cost = distance + 0.25 * off + 0.15 * tight
        if fan[m, 0] < 0.0:
            cost += 0.2
        if fan[m, 0] == 0.0 and fan[m, 1] == 0.0:
            cost += 0.3
        if cost < least_cost:
            best, least_cost = m, cost
    if best >= 0:
        return best
    most = -math.inf
    clear = (rooms[:, 2] >= margin).any()
    for m in range(fan.shape[0]):
        if (rooms[m, 2] >= margin or not clear) and rooms[m, 0] + rooms[m, 1] > most:
            best, most = m, rooms[m, 0] + rooms[m, 1]
    return max(best, 0)


@njit(cache=True)
def line_clearances(path: NDArray[np.float64], near: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance (M,) between ``near`` points (N, 2) and the straight line to each point of a path (M, 2), in
    base [m]."""
    gaps = np.empty(path.shape[0])
    for p in range(path.shape[0]):
        length = max(math.hypot(path[p, 0], path[p, 1]), 1e-9)
        ux, uy = path[p, 0] / length, path[p, 1] / length
        squared = math.inf
        for k in range(near.shape[0]):
            along = max(0.0, min(length, near[k, 0] * ux + near[k, 1] * uy))
            squared = min(squared, (near[k, 0] - along * ux) ** 2 + (near[k, 1] - along * uy) ** 2)
        gaps[p] = math.sqrt(squared)
    return gaps
