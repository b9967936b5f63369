"""Smooth bend of a map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.arrays import frozen_array, sealed
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid

Nodes = NDArray[np.float64]
"""Displacements (rows, cols, 2), x and y, of the nodes of a control grid."""

INVERSE_STEPS = 4
"""Fixed-point steps of the inverse: each one shrinks the error by the strain, which is at most some per cent."""


@dataclass(frozen=True, eq=False)
class Bend:
    """A smooth displacement of the points of a map, in its cells, bilinear between the nodes of a control grid.

    - ``corner`` (2,): place x, y of the first node; ``spacing``: distance of neighbouring nodes;
    - ``nodes`` (rows, cols, 2): displacement of each node.
    """

    corner: NDArray[np.float64]
    spacing: float
    nodes: Nodes

    @staticmethod
    def at_rest(points: NDArray[np.float64], spacing: float, beyond: int = 0) -> Bend:
        """Centre a control grid of at least 2 x 2 nodes on points (N, 2), ``beyond`` nodes wider on each side; none
        is displaced."""
        low, high = points.min(axis=0), points.max(axis=0)
        cols, rows = (np.ceil((high - low) / spacing).astype(np.int64) + 1 + 2 * beyond).clip(2).tolist()
        corner = (low + high) / 2.0 - spacing * np.array([cols - 1, rows - 1]) / 2.0
        return Bend(frozen_array(corner, np.float64), spacing, frozen_array(np.zeros((rows, cols, 2)), np.float64))

    def displaced(self, displacements: NDArray[np.float64]) -> Bend:
        """Return a bend of the same nodes with these displacements, (rows, cols, 2) or a row x, y for each node."""
        return Bend(self.corner, self.spacing, frozen_array(displacements.reshape(self.nodes.shape), np.float64))

    @property
    def places(self) -> NDArray[np.float64]:
        """Places (rows * cols, 2) of the nodes, row by row."""
        rows, cols, _ = self.nodes.shape
        row, col = np.indices((rows, cols))
        return np.asarray(self.corner + self.spacing * np.stack((col, row), axis=-1).reshape(-1, 2))

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Move points (N, 2)."""
        return points + displacements(points, self.corner, self.spacing, self.nodes)

    def remove(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points (N, 2) that the bend moves to ``points``."""
        return _unbent(points, self.corner, self.spacing, self.nodes)

    def relative_to(self, change: Similarity2) -> Bend:
        """Return the bend that remains after ``change`` takes over a part: this one is it, and then ``change``."""
        return self.displaced(change.inverse().apply(self.places + self.nodes.reshape(-1, 2)) - self.places)

    def resample(self, grid: OccupancyGrid) -> OccupancyGrid:
        """Bend a grid whose cells are those of the bend; cells that leave it are lost."""
        rows, cols = grid.frame.shape
        row, col = np.indices((rows, cols))
        before = self.remove(np.stack((col.ravel() + 0.5, row.ravel() + 0.5), axis=-1)) - 0.5
        x, y = before.astype(np.float32).reshape(rows, cols, 2).transpose(2, 0, 1)
        moved = cv2.remap(np.asarray(grid.log_odds), x, y, cv2.INTER_NEAREST, borderValue=0.0)
        return OccupancyGrid(grid.frame, sealed(moved))

    @property
    def strain(self) -> float:
        """Root mean square of the strain over the control grid, without unit; 0 for a rigid motion."""
        along_x, along_y = _means(np.diff(self.nodes, axis=1), 0), _means(np.diff(self.nodes, axis=0), 1)
        xx, yy = along_x[..., 0] / self.spacing, along_y[..., 1] / self.spacing
        xy = (along_x[..., 1] + along_y[..., 0]) / (2.0 * self.spacing)
        return float(np.sqrt((xx**2 + yy**2 + 2.0 * xy**2).mean()))


def _means(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Average neighbours along an axis."""
    first = np.take(values, range(values.shape[axis] - 1), axis)
    return np.asarray((first + np.take(values, range(1, values.shape[axis]), axis)) / 2.0)


@njit(cache=True)
def element(
    x: float, y: float, corner: NDArray[np.float64], spacing: float, nodes: Nodes
) -> tuple[int, int, float, float]:
    """Return the row and column of the node before a point, and its place between the nodes, 0 to 1 in x and y.

    A point outside the control grid moves as the nearest one inside.
    """
    u, v = (x - corner[0]) / spacing, (y - corner[1]) / spacing
    col = min(max(math.floor(u), 0), nodes.shape[1] - 2)
    row = min(max(math.floor(v), 0), nodes.shape[0] - 2)
    return row, col, min(max(u - col, 0.0), 1.0), min(max(v - row, 0.0), 1.0)


@njit(cache=True)
def displacement(x: float, y: float, corner: NDArray[np.float64], spacing: float, nodes: Nodes) -> tuple[float, float]:
    """Interpolate the displacement of a point."""
    row, col, a, b = element(x, y, corner, spacing, nodes)
    low, high = nodes[row, col : col + 2], nodes[row + 1, col : col + 2]
    dx = (1.0 - b) * ((1.0 - a) * low[0, 0] + a * low[1, 0]) + b * ((1.0 - a) * high[0, 0] + a * high[1, 0])
    dy = (1.0 - b) * ((1.0 - a) * low[0, 1] + a * low[1, 1]) + b * ((1.0 - a) * high[0, 1] + a * high[1, 1])
    return dx, dy


@njit(cache=True)
def place_before(x: float, y: float, corner: NDArray[np.float64], spacing: float, nodes: Nodes) -> tuple[float, float]:
    """Return the point that the bend moves to (x, y)."""
    px, py = x, y
    for _ in range(INVERSE_STEPS):
        dx, dy = displacement(px, py, corner, spacing, nodes)
        px, py = x - dx, y - dy
    return px, py


@njit(cache=True)
def displacements(
    points: NDArray[np.float64], corner: NDArray[np.float64], spacing: float, nodes: Nodes
) -> NDArray[np.float64]:
    """Interpolate the displacements (N, 2) of points."""
    found = np.empty((len(points), 2))
    for k in range(len(points)):
        found[k, 0], found[k, 1] = displacement(points[k, 0], points[k, 1], corner, spacing, nodes)
    return found


@njit(cache=True)
def _unbent(
    points: NDArray[np.float64], corner: NDArray[np.float64], spacing: float, nodes: Nodes
) -> NDArray[np.float64]:
    found = np.empty((len(points), 2))
    for k in range(len(points)):
        found[k, 0], found[k, 1] = place_before(points[k, 0], points[k, 1], corner, spacing, nodes)
    return found
