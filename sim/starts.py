"""Where robots begin."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mapping.se2 import SE2
from worlds.raster import true_raster
from worlds.world import World

CLEAR = 0.5
"""Distance of a start's centre to the nearest solid [m], at least; two starts are twice as far apart."""


def random_starts(rng: np.random.Generator, world: World, robots: int, radius: float = 0.2) -> tuple[SE2, ...]:
    """Draw world_from_base for that many robots of ``radius`` [m], anywhere on the largest floor they can drive.

    Each stands with its centre at least 0.5 m from any solid and 1 m from the others, in any heading. Raises
    ``ValueError`` where the floor does not hold that many.
    """
    candidates = _standing_places(world, radius)
    order = rng.permutation(len(candidates))
    headings = rng.uniform(-math.pi, math.pi, robots)
    chosen: list[NDArray[np.float64]] = []
    for place in candidates[order]:
        if len(chosen) == robots:
            break
        apart = all(math.dist(place, other) >= 2.0 * CLEAR for other in chosen)
        if apart and world.clearance(place[None])[0] >= CLEAR:
            chosen.append(place)
    if len(chosen) < robots:
        raise ValueError(f"robots is {robots}, but world {world.name!r} has clear standing room for {len(chosen)} only")
    return tuple(SE2(x, y, heading) for (x, y), heading in zip(chosen, headings, strict=True))


def _standing_places(world: World, radius: float) -> NDArray[np.float64]:
    """Points [m], (N, 2), on the largest connected floor and 0.5 m clear as far as a raster can tell."""
    raster = true_raster(world, resolution=0.1)
    to_solid = ndimage.distance_transform_edt(np.pad(raster.free, 1))[1:-1, 1:-1] * raster.frame.resolution
    floors, count = ndimage.label(to_solid > radius + raster.frame.resolution)
    if count == 0:
        return np.empty((0, 2))
    largest = 1 + int(np.argmax(np.bincount(floors.ravel())[1:]))
    return raster.frame.metres_from_cells(np.argwhere((floors == largest) & (to_solid >= CLEAR)))
