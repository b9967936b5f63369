"""Decide which of two robots goes first, without communication."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.navigation.routes import Routes
from sim.navigation.settings import RightOfWaySettings

DEFAULTS = RightOfWaySettings()


def waiting_time(room: float, other_room: float, rank: int, settings: RightOfWaySettings = DEFAULTS) -> float:
    """Return how long [s] a robot waits for another before it gives way.

    ``room`` and ``other_room`` [m] are the distances of the two robots to their nearest walls. The robot in the
    narrower place has the right of way, because it has nowhere else to go; the other backs off soon. Each robot judges
    from its own map, so even the one with the right of way gives way in the end. ``rank`` is the robot's number in the
    team and breaks ties.
    """
    base = settings.wait_with_more_room
    if room <= other_room + settings.similar_room:
        equal = room >= other_room - settings.similar_room
        base = settings.wait_with_equal_room if equal else settings.wait_with_less_room
    return base + settings.wait_per_rank * (rank % 4) + settings.wait_per_four_ranks * (rank // 4)


def wall_distance(walls: NDArray[np.float64], place: NDArray[np.float64]) -> float:
    """Return the distance [m] from ``place`` (2,) to the nearest of the wall points (N, 2), +inf without walls."""
    return float(np.sqrt(((walls - place) ** 2).sum(axis=1).min(initial=np.inf)))


def blocks_path(
    path: NDArray[np.float64],
    movers: NDArray[np.float64],
    here: NDArray[np.float64],
    settings: RightOfWaySettings = DEFAULTS,
) -> bool:
    """Return whether a moving point (N, 2) is near the robot and on its path (M, 2), all in the map [m]."""
    near = movers[np.hypot(*(movers - here).T) < settings.near] if len(movers) else movers
    if len(near) == 0:
        return False
    stretch = path[np.hypot(*(path - here).T) < settings.near + settings.path_width] if len(path) else path
    if len(stretch) == 0:
        return False
    gaps = np.hypot(*(near[:, None] - stretch).transpose(2, 0, 1))
    return bool((gaps < settings.path_width).any())


def nearest_robot(
    movers: NDArray[np.float64],
    here: NDArray[np.float64],
    radius: float,
    settings: RightOfWaySettings = DEFAULTS,
) -> NDArray[np.float64] | None:
    """Estimate the centre (2,) of the nearest robot of that radius [m] from the moving points (N, 2), None if none is
    near.

    The nearest point lies on the robot's hull, on the line to its centre.
    """
    if len(movers) == 0:
        return None
    gaps = np.hypot(*(movers - here).T)
    closest, gap = movers[int(np.argmin(gaps))], float(gaps.min())
    middle: NDArray[np.float64] = closest + (closest - here) * (radius / max(gap, 1e-6))
    return middle if gap < settings.near else None


def retreat_cell(
    routes: Routes,
    here: NDArray[np.float64],
    other: NDArray[np.float64],
    settings: RightOfWaySettings = DEFAULTS,
) -> NDArray[np.int64] | None:
    """Return the reachable cell (2,) where a robot at ``here`` best lets the one at ``other`` pass, (2,) each [m].

    The other robot will continue along the line between them, so the best cell is off that line. Short paths are
    preferred. Returns None if the robot cannot move at all.
    """
    cells = np.argwhere(routes.costs < settings.max_retreat)
    if len(cells) == 0:
        return None
    places = routes.frame.metres_from_cells(cells)
    towards = (here - other) / max(float(np.hypot(*(here - other))), 1e-6)
    off = places - other
    along = off @ towards
    offset = np.abs(off[:, 0] * towards[1] - off[:, 1] * towards[0])
    distance = np.hypot(*off.T)
    tight = np.maximum(0.0, settings.passing_distance - np.where(along > 0.0, offset, distance))
    too_near = np.maximum(0.0, settings.passing_distance + 0.3 - distance)
    badness = routes.costs[tuple(cells.T)] + 6.0 * tight + 6.0 * too_near - 0.3 * np.minimum(distance, 4.0)
    best: NDArray[np.int64] = cells[int(np.argmin(badness))]
    return best
