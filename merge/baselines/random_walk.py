"""Map merging by an adaptive random walk on the similarity of two maps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.grid import OccupancyGrid
from mapping.similarity2 import Similarity2
from merge.baselines.poses import Poses, inverses, matrices
from merge.cells import centres, compare_cells
from merge.chart import Chart
from merge.pair import PairAnswer
from merge.proposer import Proposal
from merge.published import judged, nothing_found
from merge.scale_range import ScaleRange


@dataclass(frozen=True, eq=False)
class Valued:
    """A map as the similarity sees it: for each value (free, occupied) a sample of its cells, (N, 2) centres, and the
    Manhattan distance of every cell to the nearest one of that value, (rows, cols)."""

    grid: OccupancyGrid
    cells: tuple[NDArray[np.float64], NDArray[np.float64]]
    distance: tuple[NDArray[np.float32], NDArray[np.float32]]

    @property
    def middle(self) -> NDArray[np.float64]:
        middle: NDArray[np.float64] = np.concatenate(self.cells).mean(axis=0)
        return middle

    @property
    def usable(self) -> bool:
        return all(len(cells) for cells in self.cells)


@dataclass(frozen=True)
class RandomWalk:
    """Birk and Carpin 2006, "Merging occupancy grid maps from multiple robots".

    A Gaussian random walk (Carpin and Birk 2004) over rotation and translation descends the image similarity psi, led
    by the lock on overlap: Delta = psi + lock (disagreeing - agreeing cells). A step is drawn about the walk's last
    steps with their mean and covariance, which adapt; it is kept if it is better, or by a random selector. Several
    walks go side by side, and the best place of all wins. Rigid: the scale is the middle of the range.

    - ``walks``, ``steps``: so many walks of so many steps each;
    - ``memory``: steps kept whose mean and covariance the next is drawn by;
    - ``lock_cells``: weight of the share of cells that disagree less that of those that agree, in cells; shares and
      not counts, each value counting alike as it does in psi, so that one weight does for maps of any size;
    - ``warmth_cells``: the selector keeps a step that is worse by d with chance exp(-d / warmth), as annealing does,
      the warmth falling to zero over the walk;
    - ``cells``: sample of each value's cells that the similarity is computed on;
    - ``acceptance_index``: what must be reached, 98 %.
    """

    walks: int = 100
    steps: int = 600
    memory: int = 8
    lock_cells: float = 200.0
    warmth_cells: float = 2.0
    cells: int = 250
    acceptance_index: float = 0.98

    def __post_init__(self) -> None:
        for name in ("walks", "steps", "memory", "cells"):
            if getattr(self, name) < 1:
                raise ValueError(f"RandomWalk: {name} is {getattr(self, name)}, must be at least 1")
        for name in ("lock_cells", "warmth_cells"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"RandomWalk: {name} is {getattr(self, name)}, must be finite and not negative")
        if not 0.0 < self.acceptance_index <= 1.0:
            raise ValueError(f"RandomWalk: acceptance_index is {self.acceptance_index}, must lie in (0, 1]")

    def describe(self, chart: Chart) -> Valued:
        """The map's cells and distances by value."""
        grid = chart.grid
        masks = grid.free, grid.occupied
        cells = [centres(mask) for mask in masks]
        kept = [c[np.linspace(0, len(c) - 1, min(len(c), self.cells)).astype(np.intp)] for c in cells]
        return Valued(grid, (kept[0], kept[1]), (manhattan(masks[0]), manhattan(masks[1])))

    def propose(
        self, target: Valued, source: Valued, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Where each walk was best, best first; empty where a map has no free or no occupied cell."""
        if not target.usable or not source.usable:
            return ()
        return tuple(Proposal(transform) for transform in self._walked(target, source, scale.middle, rng))

    def published(self, target: Valued, source: Valued, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """The best place of all walks, and its acceptance index."""
        if not target.usable or not source.usable:
            return nothing_found()
        best = self._walked(target, source, scale.middle, rng)[0]
        index = compare_cells(target.grid, source.grid, best).acceptance_index
        return judged(best, "the acceptance index", 0.0 if index is None else index, self.acceptance_index)

    def _walked(self, target: Valued, source: Valued, size: float, rng: np.random.Generator) -> list[Similarity2]:
        reach = math.hypot(*target.grid.frame.shape) / 6.0
        middle = np.append(target.middle, 0.0)
        here = middle + rng.standard_normal((self.walks, 3)) * (reach, reach, 0.0)
        here[:, 2] = rng.uniform(-math.pi, math.pi, self.walks)
        cost = self.dissimilarity(target, source, here, size)
        best, best_cost = here.copy(), cost.copy()
        memory = rng.standard_normal((self.memory, self.walks, 3)) * (reach, reach, 1.0)
        for step in range(self.steps):
            there = here + _steps(memory, rng)
            new = self.dissimilarity(target, source, there, size)
            warmth = self.warmth_cells * (1.0 - step / self.steps)
            kept = _selected(new - cost, warmth, rng)
            memory[step % self.memory, kept] = (there - here)[kept]
            here[kept], cost[kept] = there[kept], new[kept]
            better = cost < best_cost
            best[better], best_cost[better] = here[better], cost[better]
        ranked = best[np.argsort(best_cost, kind="stable")]
        return [Similarity2.from_matrix(matrix) for matrix in matrices(ranked, source.middle, size)]

    def dissimilarity(self, target: Valued, source: Valued, poses: Poses, size: float) -> NDArray[np.float64]:
        """Delta (K,) of the source at each pose (K, 3), in cells of the target."""
        there = matrices(poses, source.middle, size)
        back = inverses(there)
        psi, agree, disagree = np.zeros(len(poses)), np.zeros(len(poses)), np.zeros(len(poses))
        for value in (0, 1):
            psi += mean_distances(target.distance[value], source.cells[value], there)  # d(m2, m1, c)
            psi += size * mean_distances(source.distance[value], target.cells[value], back)  # d(m1, m2, c)
            agree += shares(target.distance[value], source.cells[value], there)
            disagree += shares(target.distance[1 - value], source.cells[value], there)
        return psi + self.lock_cells * (disagree - agree) / 2.0


def manhattan(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Manhattan distance of each cell (rows, cols) to the nearest set one: the d-map, algorithm 1 of Birk and Carpin
    2006, by OpenCV's two passes. Without a set cell it is the longest way there could be."""
    if not mask.any():
        return np.full(mask.shape, float(sum(mask.shape)), np.float32)
    return cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L1, 3).astype(np.float32)


@njit(cache=True)
def _cell(matrix: NDArray[np.float64], point: NDArray[np.float64]) -> tuple[int, int]:
    x = matrix[0, 0] * point[0] + matrix[0, 1] * point[1] + matrix[0, 2]
    y = matrix[1, 0] * point[0] + matrix[1, 1] * point[1] + matrix[1, 2]
    return math.floor(y), math.floor(x)


@njit(cache=True)
def mean_distances(
    distance: NDArray[np.float32], points: NDArray[np.float64], matrices: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean distance (K,) of points (N, 2), moved by each of the matrices (K, 2, 3), to the nearest cell of the value.

    Beyond the raster the way to its border is added, which is exact for Manhattan distances.
    """
    rows, cols = distance.shape
    means = np.zeros(len(matrices))
    for k in range(len(matrices)):
        for i in range(len(points)):
            row, col = _cell(matrices[k], points[i])
            inner_col, inner_row = min(max(col, 0), cols - 1), min(max(row, 0), rows - 1)
            means[k] += distance[inner_row, inner_col] + abs(col - inner_col) + abs(row - inner_row)
        means[k] /= len(points)
    return means


@njit(cache=True)
def shares(
    distance: NDArray[np.float32], points: NDArray[np.float64], matrices: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share (K,) of the points (N, 2), moved by each of the matrices (K, 2, 3), that fall on cells of the value."""
    rows, cols = distance.shape
    found = np.zeros(len(matrices))
    for k in range(len(matrices)):
        for i in range(len(points)):
            row, col = _cell(matrices[k], points[i])
            if 0 <= col < cols and 0 <= row < rows and distance[row, col] == 0.0:
                found[k] += 1.0
        found[k] /= len(points)
    return found


LEAST_STEP = np.array([0.4, 0.4, 0.003])
"""Standard deviation below which steps do not shrink: x, y [cells], yaw [rad]. So the walk reaches every place."""


def _steps(memory: NDArray[np.float64], rng: np.random.Generator) -> Poses:
    """Steps (walks, 3) with about the mean and covariance of the last ones (memory, walks, 3), never quite at rest."""
    mean: Poses = memory.mean(axis=0)
    weights = rng.standard_normal(memory.shape[:2]) / math.sqrt(len(memory))
    spread = np.einsum("mw,mwk->wk", weights, memory - mean)  # its covariance is that of the memory
    steps: Poses = mean + spread + rng.standard_normal(mean.shape) * LEAST_STEP
    return steps


def _selected(worse: NDArray[np.float64], warmth: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    draws = rng.random(len(worse))
    return (worse < 0.0) | (draws < np.exp(-np.maximum(worse, 0.0) / max(warmth, 1e-9)))
