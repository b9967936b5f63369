"""Let beams pass through panes of glass that they hit at an angle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mapping.arrays import frozen_array
from mapping.seeds import Role, stream
from sim.sensors.adversity.ray_casting import crossing
from sim.sensors.adversity.settings import Adversity
from worlds.polygon import edges
from worlds.world import World

NEAR = 0.01
"""A beam that ends this near to a pane hits it [m]."""
SPACING = 0.02
"""Distance between the points that stand for a pane [m]."""


@dataclass(frozen=True, eq=False)
class GlassWalls:
    """Hold the panes of a world.

    ``segments`` (M, 2, 2) [m] are the edges of all solids, and ``owners`` (M,) the number of the solid of each.
    ``panes`` (K, 2, 2) [m] are those pieces of edges that are of glass, and ``pane_owners`` (K,) their solids.
    ``adversity`` says what a pane lets through.
    """

    segments: NDArray[np.float64]
    owners: NDArray[np.int64]
    panes: NDArray[np.float64]
    pane_owners: NDArray[np.int64]
    adversity: Adversity

    def __post_init__(self) -> None:
        for name in ("segments", "panes"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), np.float64))
        for name in ("owners", "pane_owners"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), np.int64))


def glaze(world: World, adversity: Adversity, seed: int) -> GlassWalls:
    """Cut the walls of a world into panes, a share of them of glass.

    An edge is cut into equal panes of about ``pane_width``; edges of less than half a pane have none. A wall up to
    ``glass_depth`` thick is of glass on both sides, and the side that counts is the one that leads to +x, or else +y.
    Each pane draws one number, so that the glass of a lower share is also glass at a higher one.
    """
    sides = [edges(polygon) for polygon in world.obstacles]
    segments = np.concatenate([np.empty((0, 2, 2)), *sides])
    owners = np.repeat(np.arange(len(sides)), [len(each) for each in sides])
    panes, edge = _cut(segments, adversity.pane_width)
    chosen = stream(seed, Role.GLASS).random(len(panes)) < adversity.glass
    panes, pane_owners = panes[chosen], owners[edge[chosen]]
    along = panes[:, 1] - panes[:, 0]
    inwards = np.stack((-along[:, 1], along[:, 0]), axis=-1) / np.hypot(*along.T)[:, None]
    thickness, _ = _cast_behind(panes.mean(axis=1), inwards, np.zeros(len(panes)), pane_owners, segments, owners)
    thin = thickness <= adversity.glass_depth
    counts = ~thin | (along[:, 0] > NEAR) | ((np.abs(along[:, 0]) <= NEAR) & (along[:, 1] > 0.0))
    both = thin & counts
    opposite = panes[both] + (thickness[both, None] * inwards[both])[:, None]
    return GlassWalls(
        segments,
        owners,
        np.concatenate((panes[counts], opposite)),
        np.concatenate((pane_owners[counts], pane_owners[both])),
        adversity,
    )


def _cut(segments: NDArray[np.float64], width: float) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Cut segments (M, 2, 2) into panes (K, 2, 2), and return the number of the segment of each."""
    along = segments[:, 1] - segments[:, 0]
    counts = np.floor(np.hypot(*along.T) / width + 0.5).astype(np.int64)
    edge = np.repeat(np.arange(len(segments)), counts)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    shares = np.stack((number, number + 1), axis=-1) / counts[edge, None]
    return segments[edge, 0][:, None] + shares[..., None] * along[edge][:, None], edge


def see_through(
    glass: GlassWalls, origins: NDArray[np.float64], directions: NDArray[np.float64], ranges: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the ranges (B,) [m] of beams from ``origins`` (B, 2) along unit ``directions`` (B, 2) past the panes.

    ``ranges`` (B,) [m] are those to the solids, +inf for no return. A beam that passes a pane leaves the solid behind
    it and returns from the next one, or not at all if there is none, or the solid is thicker than ``glass_depth``.
    """
    passed, pane, cosine = _passing(glass, origins, directions, ranges)
    if not passed.size:
        return ranges
    starts, ways, reached = origins[passed], directions[passed], ranges[passed]
    leaves, behind = _cast_behind(starts, ways, reached, glass.pane_owners[pane], glass.segments, glass.owners)
    changed = ranges.copy()
    changed[passed] = np.where((leaves - reached) * cosine <= glass.adversity.glass_depth, behind, np.inf)
    return changed


def _passing(
    glass: GlassWalls, origins: NDArray[np.float64], directions: NDArray[np.float64], ranges: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the numbers of the beams that pass a pane, and the number of the pane and the cosine of the angle of
    incidence of each."""
    hit = np.flatnonzero(np.isfinite(ranges))
    if not (len(glass.panes) and hit.size):
        return hit[:0], hit[:0], ranges[:0]
    points, pane_of_point = _points(glass.panes)
    ends = origins[hit] + ranges[hit, None] * directions[hit]
    nearest = np.asarray(cKDTree(points).query(ends, distance_upper_bound=SPACING + NEAR)[1])
    found = nearest < len(points)
    hit, ends, pane = hit[found], ends[found], pane_of_point[nearest[found]]
    along = glass.panes[pane, 1] - glass.panes[pane, 0]
    normal = np.stack((-along[:, 1], along[:, 0]), axis=-1) / np.hypot(*along.T)[:, None]
    on_pane = np.abs(((ends - glass.panes[pane, 0]) * normal).sum(axis=1)) <= NEAR
    cosine = np.abs((directions[hit] * normal).sum(axis=1))
    passes = on_pane & (cosine < math.cos(glass.adversity.glass_angle))
    return hit[passes], pane[passes], cosine[passes]


def _points(panes: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    along = panes[:, 1] - panes[:, 0]
    counts = np.ceil(np.hypot(*along.T) / SPACING).astype(np.int64) + 1
    pane = np.repeat(np.arange(len(panes)), counts)
    number = np.arange(len(pane)) - np.repeat(np.cumsum(counts) - counts, counts)
    return panes[pane, 0] + (number / (counts[pane] - 1))[:, None] * along[pane], pane


@njit(cache=True)
def _cast_behind(
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    ranges: NDArray[np.float64],
    solids: NDArray[np.int64],
    segments: NDArray[np.float64],
    owners: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the ranges (B,) at which beams leave the solids (B,) that they hit, and those of the next solids."""
    left, behind = np.empty(len(ranges)), np.empty(len(ranges))
    for beam in range(len(ranges)):
        leaves, next_solid = math.inf, math.inf
        for each in range(len(segments)):
            reach = crossing(
                origins[beam, 0], origins[beam, 1], directions[beam, 0], directions[beam, 1], segments[each]
            )
            if owners[each] != solids[beam]:
                if reach > ranges[beam] - NEAR:
                    next_solid = min(next_solid, reach)
            elif reach > ranges[beam] + NEAR:
                leaves = min(leaves, reach)
        left[beam], behind[beam] = leaves, next_solid
    return left, behind
