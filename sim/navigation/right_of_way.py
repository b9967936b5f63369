"""Who goes first where two robots meet, without a word between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.navigation.routes import Routes

NEAR = 1.0
"""A robot nearer than this [m] may be in the way."""
AHEAD = 0.55
"""It is in the way if it stands this near to the path [m]."""
WIDER = 0.1
"""A difference in room [m] that both surely see alike."""
RETREAT = 5.0
"""Farthest way that a robot drives to let another pass [m]."""
ASIDE = 0.9
"""Distance from the other's way [m] at which it can pass."""
STEP_APART, FEW_APART = 2.0, 0.1
"""How much longer [s] each of four robots waits than the one before it in the team, so that not all give way at once,
and each four than the four before."""


def patience(room: float, other_room: float, rank: int) -> float:
    """How long [s] a robot stands before another until it gives way.

    The one in the narrower place, by the distance to the nearest wall [m], has the right of way, as it can go
    nowhere else; the other soon backs off. Both judge from maps of their own, so even the one in the right gives
    way at last. ``rank`` is the robot's number in the team, which it knows: equals do not act at once.
    """
    base = 0.6
    if room <= other_room + WIDER:
        base = 2.0 if room >= other_room - WIDER else 6.0
    return base + STEP_APART * (rank % 4) + FEW_APART * (rank // 4)


def room_at(walls: NDArray[np.float64], place: NDArray[np.float64]) -> float:
    """From a place, (2,), to the nearest of the walls' points, (N, 2) [m]; +inf without any."""
    return float(np.sqrt(((walls - place) ** 2).sum(axis=1).min(initial=np.inf)))


def in_the_way(path: NDArray[np.float64], movers: NDArray[np.float64], here: NDArray[np.float64]) -> bool:
    """Whether a seen thing that moves, (N, 2), stands near the robot and on its path, (M, 2), all in the map [m]."""
    near = movers[np.hypot(*(movers - here).T) < NEAR] if len(movers) else movers
    if len(near) == 0:
        return False
    stretch = path[np.hypot(*(path - here).T) < NEAR + AHEAD] if len(path) else path
    if len(stretch) == 0:
        return False
    gaps = np.hypot(*(near[:, None] - stretch).transpose(2, 0, 1))
    return bool((gaps < AHEAD).any())


def nearest(movers: NDArray[np.float64], here: NDArray[np.float64], radius: float) -> NDArray[np.float64] | None:
    """The middle of the nearest robot of that radius [m] among the points seen of things that move, (N, 2), if it is
    near: (2,). Its nearest point lies on its hull, on the line to its middle."""
    if len(movers) == 0:
        return None
    gaps = np.hypot(*(movers - here).T)
    closest, gap = movers[int(np.argmin(gaps))], float(gaps.min())
    middle: NDArray[np.float64] = closest + (closest - here) * (radius / max(gap, 1e-6))
    return middle if gap < NEAR else None


def retreat(routes: Routes, here: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """The reachable cell, (2,), where a robot at ``here`` best lets the one at ``other`` pass, (2,) each [m].

    The other will come on along the line between them, so that the best place lies beside that line; short ways are
    better than long ones. None where the robot cannot move at all.
    """
    cells = np.argwhere(routes.costs < RETREAT)
    if len(cells) == 0:
        return None
    places = routes.frame.metres_from_cells(cells)
    towards = (here - other) / max(float(np.hypot(*(here - other))), 1e-6)
    off = places - other
    along = off @ towards
    beside = np.abs(off[:, 0] * towards[1] - off[:, 1] * towards[0])
    distance = np.hypot(*off.T)
    tight = np.maximum(0.0, ASIDE - np.where(along > 0.0, beside, distance))
    too_near = np.maximum(0.0, ASIDE + 0.3 - distance)
    badness = routes.costs[tuple(cells.T)] + 6.0 * tight + 6.0 * too_near - 0.3 * np.minimum(distance, 4.0)
    best: NDArray[np.int64] = cells[int(np.argmin(badness))]
    return best
