"""Map merging by an adaptive random walk on the similarity of two maps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.literature.acceptance import accept_by_score, no_answer
from merge.literature.poses import Poses, inverses, matrices
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import centres
from merge.progress import track
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.verification.cell_overlap import compare_cells


@dataclass(frozen=True, eq=False)
class Valued:
    """A map for the image similarity, by value (free, occupied).

    A sample of the cells of each value, centres (N, 2), and the Manhattan distance of every cell to the nearest one of
    that value, (rows, cols, 2).
    """

    grid: OccupancyGrid
    cells: tuple[NDArray[np.float64], NDArray[np.float64]]
    distances: NDArray[np.int16]

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
    - ``acceptance_index``: least acceptance index of an accepted answer;
    - ``least_step_cells``, ``least_turn`` [rad]: standard deviation below which steps do not shrink, so that the walk
      reaches every place.
    """

    walks: int = 100
    steps: int = 600
    memory: int = 8
    lock_cells: float = 200.0
    warmth_cells: float = 2.0
    cells: int = 250
    acceptance_index: float = 0.98
    least_step_cells: float = 0.4
    least_turn: float = 0.003

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("lock_cells", "warmth_cells"))
        if self.acceptance_index > 1.0:
            raise ValueError(f"RandomWalk: acceptance_index is {self.acceptance_index}, must lie in (0, 1]")

    def describe(self, prepared: PreparedMap) -> Valued:
        """Collect the map's cells and distances by value."""
        grid = prepared.grid
        masks = grid.free, grid.occupied
        cells = [centres(mask) for mask in masks]
        kept = [c[np.linspace(0, len(c) - 1, min(len(c), self.cells)).astype(np.intp)] for c in cells]
        return Valued(grid, (kept[0], kept[1]), np.stack([manhattan(mask) for mask in masks], axis=-1))

    def propose(
        self, target: Valued, source: Valued, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the best pose of each walk, best first; none if a map has no free or no occupied cell."""
        if not target.usable or not source.usable:
            return ()
        return tuple(Proposal(transform) for transform in self._walked(target, source, scale.middle, rng))

    def published(self, target: Valued, source: Valued, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """Return the best pose of all walks, and its acceptance index."""
        if not target.usable or not source.usable:
            return no_answer()
        best = self._walked(target, source, scale.middle, rng)[0]
        index = compare_cells(target.grid, source.grid, best).acceptance_index
        return accept_by_score(best, "the acceptance index", 0.0 if index is None else index, self.acceptance_index)

    def _walked(self, target: Valued, source: Valued, size: float, rng: np.random.Generator) -> list[Similarity2]:
        reach = math.hypot(*target.grid.frame.shape) / 6.0
        middle = np.append(target.middle, 0.0)
        here = middle + rng.standard_normal((self.walks, 3)) * (reach, reach, 0.0)
        here[:, 2] = rng.uniform(-math.pi, math.pi, self.walks)
        cost = self.dissimilarity(target, source, here, size)
        best, best_cost = here.copy(), cost.copy()
        memory = rng.standard_normal((self.memory, self.walks, 3)) * (reach, reach, 1.0)
        least = self.least_step_cells, self.least_step_cells, self.least_turn
        for step in track(range(self.steps), "steps"):
            there = here + _steps(memory, least, rng)
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
        """Compute Delta (K,) of the source at each pose (K, 3), in cells of the target."""
        there = matrices(poses, source.middle, size)
        back = inverses(there)
        psi, lock = np.zeros(len(poses)), np.zeros(len(poses))
        for value in (0, 1):
            on_target, agree, disagree = cell_distances(target.distances, value, source.cells[value], there)
            on_source, _, _ = cell_distances(source.distances, value, target.cells[value], back)
            psi += on_target + size * on_source  # d(m2, m1, c) + d(m1, m2, c)
            lock += disagree - agree
        return psi + self.lock_cells * lock / 2.0


def manhattan(mask: NDArray[np.bool_]) -> NDArray[np.int16]:
    """Compute the Manhattan distance of each cell (rows, cols) to the nearest set cell.

    Source: d-map, algorithm 1 of Birk and Carpin 2006, by OpenCV's two passes. Without a set cell it is the greatest
    possible distance.
    """
    longest = min(sum(mask.shape), np.iinfo(np.int16).max)
    if not mask.any():
        return np.full(mask.shape, longest, np.int16)
    distance = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L1, 3)
    return np.minimum(distance, longest).astype(np.int16)


@njit(cache=True)
def cell_distances(
    distances: NDArray[np.int16], value: int, points: NDArray[np.float64], matrices: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Look up points (N, 2), moved by each of the matrices (K, 2, 3), in a map of distances (rows, cols, 2).

    Return their mean distance (K,) to the nearest cell of the value, and the shares (K,) on cells of the value and of
    the other value. Beyond the raster the distance to its border is added, which is exact for Manhattan distances.
    Branches are avoided for speed.
    """
    rows, cols = distances.shape[0], distances.shape[1]
    number = len(points)
    means, agree, disagree = np.zeros(len(matrices)), np.zeros(len(matrices)), np.zeros(len(matrices))
    row_of, col_of = np.empty(number, np.int32), np.empty(number, np.int32)
    for k in range(len(matrices)):
        m = matrices[k]
        for i in range(number):
            x, y = points[i, 0], points[i, 1]
            col_of[i] = math.floor(m[0, 0] * x + m[0, 1] * y + m[0, 2])
            row_of[i] = math.floor(m[1, 0] * x + m[1, 1] * y + m[1, 2])
        away, same, other = 0, 0, 0
        for i in range(number):
            row, col = min(max(row_of[i], 0), rows - 1), min(max(col_of[i], 0), cols - 1)
            beyond = abs(row_of[i] - row) + abs(col_of[i] - col)
            distance = distances[row, col, value] + beyond
            away += distance
            same += distance == 0
            other += distances[row, col, 1 - value] + beyond == 0
        means[k], agree[k], disagree[k] = away / number, same / number, other / number
    return means, agree, disagree


def _steps(memory: NDArray[np.float64], least: Sequence[float], rng: np.random.Generator) -> Poses:
    """Draw steps (walks, 3) with about the mean and covariance of the last ones (memory, walks, 3), never 0."""
    mean: Poses = memory.mean(axis=0)
    weights = rng.standard_normal(memory.shape[:2]) / math.sqrt(len(memory))
    spread = np.einsum("mw,mwk->wk", weights, memory - mean)  # its covariance is that of the memory
    steps: Poses = mean + spread + rng.standard_normal(mean.shape) * np.array(least)
    return steps


def _selected(worse: NDArray[np.float64], warmth: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    draws = rng.random(len(worse))
    return (worse < 0.0) | (draws < np.exp(-np.maximum(worse, 0.0) / max(warmth, 1e-9)))
