"""Let beams pass through panes of glass that they hit at an angle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

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

    def nearest_panes(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the number of the pane next to each point (N, 2) [m], -1 if none is near."""
        tree, pane = self._samples
        nearest = np.asarray(tree.query(points, distance_upper_bound=SPACING + NEAR)[1])
        return np.where(nearest < len(pane), pane[np.minimum(nearest, len(pane) - 1)], -1)

    @cached_property
    def _samples(self) -> tuple[cKDTree, NDArray[np.int64]]:
        """Points on the panes, and the number of the pane of each."""
        along = self.panes[:, 1] - self.panes[:, 0]
        counts = np.ceil(np.hypot(*along.T) / SPACING).astype(np.int64) + 1
        pane = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(pane)) - np.repeat(np.cumsum(counts) - counts, counts)
        return cKDTree(self.panes[pane, 0] + (number / (counts[pane] - 1))[:, None] * along[pane]), pane


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
    inwards = _inward_normals(panes)
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
    glass: GlassWalls, origin: NDArray[np.float64], directions: NDArray[np.float64], ranges: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the ranges (B,) [m] of beams from ``origin`` (2,) along unit ``directions`` (B, 2) past the panes.

    ``ranges`` (B,) [m] are those to the solids, +inf for no return. A beam that passes a pane leaves the solid behind
    it and returns from the next one, or not at all if there is none, or the solid is thicker than ``glass_depth``.
    """
    hit = np.flatnonzero(np.isfinite(ranges))
    if not (len(glass.panes) and hit.size):
        return ranges
    ends = origin + ranges[hit, None] * directions[hit]
    pane = glass.nearest_panes(ends)
    hit, ends, pane = hit[pane >= 0], ends[pane >= 0], pane[pane >= 0]
    normal = _inward_normals(glass.panes[pane])
    cosine = np.abs((directions[hit] * normal).sum(axis=1))
    on_pane = np.abs(((ends - glass.panes[pane, 0]) * normal).sum(axis=1)) <= NEAR
    passes = on_pane & (cosine < math.cos(glass.adversity.glass_angle))
    hit, owners = hit[passes], glass.pane_owners[pane[passes]]
    starts = np.tile(origin, (len(hit), 1))
    leaves, behind = _cast_behind(starts, directions[hit], ranges[hit], owners, glass.segments, glass.owners)
    thickness = (leaves - ranges[hit]) * cosine[passes]
    changed = ranges.copy()
    changed[hit] = np.where(thickness <= glass.adversity.glass_depth, behind, np.inf)
    return changed


def _inward_normals(panes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit normal (K, 2) of each pane (K, 2, 2) that points into its solid."""
    along = panes[:, 1] - panes[:, 0]
    return np.asarray(np.stack((-along[:, 1], along[:, 0]), axis=-1) / np.hypot(*along.T)[:, None])


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
