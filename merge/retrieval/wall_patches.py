"""Patches of a map around its walls, described so that neither the map's rotation nor its origin matters.

A wall and its normal into the free space are a frame of their own, as in the local reference frames of shape
descriptors (SHOT, Tombari et al. 2010). So a patch sampled in that frame needs no other invariance, and two patches
that look alike suggest one relative pose of their maps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import thinned
from merge.retrieval.settings import PatchSettings

DIRECTIONS = 8
"""Directions of walls of which one patch each is kept in a square."""


@dataclass(frozen=True, eq=False)
class WallPatches:
    """The patches of a map: ``points`` (N, 2) on walls [m] and ``yaws`` (N,) of their normals [rad], in the frame of
    the map, and ``waves`` (N, D): amplitudes of cosine waves, first those of walls, then those of free space."""

    points: NDArray[np.float64]
    yaws: NDArray[np.float64]
    waves: NDArray[np.float32]


def describe_walls(prepared: PreparedMap, metres: Similarity2, settings: PatchSettings) -> WallPatches:
    """Describe the patches of a map; ``metres`` leads from cells of the prepared map to metres of the map."""
    cell = metres.scale
    chosen = _spread(prepared, settings.spacing / cell, settings.most)
    points, normals = prepared.points[chosen], prepared.normals[chosen]
    u = np.arange(-settings.half_width, settings.half_width + 1e-9, settings.step) / cell
    v = np.arange(-settings.behind, settings.depth + 1e-9, settings.step) / cell
    along = np.stack((normals[:, 1], -normals[:, 0]), axis=-1)
    places = (
        points[:, None, None]
        + u[None, None, :, None] * along[:, None, None]
        + v[None, :, None, None] * normals[:, None, None]
    ).astype(np.float32)
    weights = _cosines(len(v), settings.waves), _cosines(len(u), settings.waves)
    kept = np.add.outer(np.arange(settings.waves), np.arange(settings.waves)) < settings.waves
    waves = []
    for raster, weight in ((prepared.grid.occupied, settings.wall_weight), (prepared.grid.free, 1.0)):
        smooth = np.asarray(cv2.GaussianBlur(raster.astype(np.float32), (0, 0), settings.blur / cell), np.float32)
        samples = weight * _sample(smooth, places)
        across = np.einsum("nvu,av->nau", samples, weights[0])
        waves.append(np.einsum("nau,bu->nab", across, weights[1])[:, kept])
    yaws = np.arctan2(normals[:, 1], normals[:, 0]) + metres.yaw
    return WallPatches(metres.apply(points), yaws, np.concatenate(waves, axis=1).astype(np.float32))


def _spread(prepared: PreparedMap, spacing: float, most: int) -> NDArray[np.intp]:
    """Choose surface points with normals, one for each square of side ``spacing`` [cells] and direction."""
    oriented = np.flatnonzero(prepared.normals.any(axis=1))
    points, normals = prepared.points[oriented], prepared.normals[oriented]
    squares = np.floor(points / spacing)
    directions = np.round(np.arctan2(normals[:, 1], normals[:, 0]) * (DIRECTIONS / math.tau)) % DIRECTIONS
    _, first = np.unique(np.column_stack((squares, directions)), axis=0, return_index=True)
    return oriented[np.sort(first)[thinned(len(first), most)[0]]]


def _sample(raster: NDArray[np.float32], places: NDArray[np.float32]) -> NDArray[np.float32]:
    """Interpolate a raster at places (N, V, U, 2) [cells]: (N, V, U); 0 beyond it."""
    number, rows, cols = places.shape[:3]
    flat = places.reshape(number * rows, cols, 2)
    found = np.empty(flat.shape[:2], np.float32)
    for first in range(0, len(flat), 32000):  # OpenCV's limit of a side
        part = flat[first : first + 32000]
        x, y = np.ascontiguousarray(part[..., 0] - 0.5), np.ascontiguousarray(part[..., 1] - 0.5)
        found[first : first + 32000] = cv2.remap(raster, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    return found.reshape(number, rows, cols)


def _cosines(samples: int, waves: int) -> NDArray[np.float64]:
    """Return the first rows (waves, samples) of the orthonormal discrete cosine transform."""
    rows = np.cos(np.pi / samples * np.outer(np.arange(waves), np.arange(samples) + 0.5))
    return np.asarray(rows / np.linalg.norm(rows, axis=1)[:, None])
