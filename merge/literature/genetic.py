"""Map merging by a genetic algorithm that maximises the consistency of two maps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid
from merge.literature.acceptance import accept_by_score, no_answer
from merge.literature.poses import Poses, matrices
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import centres
from merge.progress import track
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Occupancy likelihood of a map.

    ``fields`` are rasters (rows, cols) in -1 (free) to 1 (wall), 0 unknown, walls blurred by each of ``blurs_cells``;
    then the sampled centres (N, 2) of occupied cells, and the mean (2,) of them all.
    """

    fields: tuple[NDArray[np.float32], ...]
    walls: NDArray[np.float64]
    middle: NDArray[np.float64]


@dataclass(frozen=True)
class Genetic:
    """After Li, Tsukada, Nashashibi and Parent 2014, "Multivehicle cooperative local mapping".

    An individual is a pose of one map on the other; its fitness is the consistency of the occupancy likelihoods. In
    each generation those above the mean are the elite: a mutation takes an elite's place where it is fitter. The others
    are replaced, by a mutation of an elite, by the position of one elite with the rotation of another, by a
    linear combination of two, or by a new individual. Rigid: the scale is the middle of the range.

    Theirs starts about a pose that is roughly known, from satellites; here it starts anywhere, with more individuals,
    and goes from coarse to fine.

    - ``spread_cells``, ``spread_deg``: standard deviations of mutations at first; they shrink over the generations to
      a tenth;
    - ``blurs_cells``: standard deviations by which walls are widened in turn, so that near is better than far;
    - ``consistency``: least consistency of an accepted answer.
    """

    individuals: int = 300
    generations: int = 90
    spread_cells: float = 12.0
    spread_deg: float = 8.0
    blurs_cells: tuple[float, ...] = (8.0, 4.0, 2.0)
    walls: int = 250
    consistency: float = 0.5
    proposals: int = 24

    def __post_init__(self) -> None:
        require_valid(self)

    def describe(self, prepared: PreparedMap) -> Likelihood:
        """Compute the map's likelihood fields, and sample its walls."""
        grid = prepared.grid
        points = centres(grid.occupied)
        kept = np.linspace(0, len(points) - 1, min(len(points), self.walls)).astype(np.intp)
        middle = points.mean(axis=0) if len(points) else np.zeros(2)
        fields = tuple(likelihood(grid.occupied, grid.free, blur) for blur in self.blurs_cells)
        return Likelihood(fields, points[kept], middle)

    def propose(
        self, target: Likelihood, source: Likelihood, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the fittest of the last generation, best first; none if a map has no wall."""
        if not len(target.walls) or not len(source.walls):
            return ()
        poses, _ = self._evolved(target, source, scale.middle, rng)
        fittest = matrices(poses[: self.proposals], source.middle, scale.middle)
        return tuple(Proposal(Similarity2.from_matrix(matrix)) for matrix in fittest)

    def published(
        self, target: Likelihood, source: Likelihood, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the fittest individual of the last generation."""
        if not len(target.walls) or not len(source.walls):
            return no_answer()
        poses, fitness = self._evolved(target, source, scale.middle, rng)
        best = Similarity2.from_matrix(matrices(poses[:1], source.middle, scale.middle)[0])
        return accept_by_score(best, "the consistency", max(0.0, float(fitness[0])), self.consistency)

    def _evolved(
        self, target: Likelihood, source: Likelihood, size: float, rng: np.random.Generator
    ) -> tuple[Poses, NDArray[np.float64]]:
        """Return the last generation's poses and fitness, fittest first."""
        spread = np.array([self.spread_cells, self.spread_cells, math.radians(self.spread_deg)])
        poses = self._newborn(target.fields[0], rng, self.individuals)
        for generation in track(range(self.generations), "generations"):
            mutation = spread * 10.0 ** (-generation / self.generations)
            field = target.fields[generation * len(target.fields) // self.generations]
            poses = self._next(field, source, poses, size, mutation, rng)
        fitness = consistency(target.fields[-1], source, poses, size)
        order = np.argsort(-fitness, kind="stable")
        return poses[order], fitness[order]

    def _next(
        self,
        field: NDArray[np.float32],
        source: Likelihood,
        poses: Poses,
        size: float,
        mutation: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> Poses:
        """Make the next generation: fitter mutants of the elite, and successors of the others."""
        fitness = consistency(field, source, poses, size)
        fit = fitness >= min(fitness.mean(), fitness.max())  # rounded, the mean of equals may be above them all
        elite = poses[fit]
        mutants = elite + rng.standard_normal(elite.shape) * mutation
        fitter = consistency(field, source, mutants, size) > fitness[fit]
        others = self._replaced(field, elite, len(poses) - len(elite), mutation, rng)
        return np.concatenate((np.where(fitter[:, None], mutants, elite), others))

    def _newborn(self, field: NDArray[np.float32], rng: np.random.Generator, number: int) -> Poses:
        rows, cols = field.shape
        return rng.uniform((0.0, 0.0, -math.pi), (cols, rows, math.pi), (number, 3))

    def _replaced(
        self,
        field: NDArray[np.float32],
        elite: Poses,
        number: int,
        mutation: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> Poses:
        one, other = elite[rng.integers(len(elite), size=(2, number))]
        mutated = one + rng.standard_normal((number, 3)) * mutation
        mixed = np.column_stack((one[:, :2], other[:, 2]))
        between = one + rng.random((number, 1)) * _difference(other, one)
        kinds = np.stack((mutated, mixed, between, self._newborn(field, rng, number)))
        return kinds[rng.integers(len(kinds), size=number), np.arange(number)]


def likelihood(occupied: NDArray[np.bool_], free: NDArray[np.bool_], blur_cells: float) -> NDArray[np.float32]:
    """Compute the occupancy likelihood (rows, cols): -1 for free cells, 1 for walls, between near a wall."""
    away = cv2.distanceTransform((~occupied).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    near = np.exp(-0.5 * (away / blur_cells) ** 2) if occupied.any() else np.zeros(occupied.shape)
    return np.where(free, 2.0 * near - 1.0, near).astype(np.float32)


def consistency(field: NDArray[np.float32], source: Likelihood, poses: Poses, size: float) -> NDArray[np.float64]:
    """Average the target's likelihood (K,) over the source's walls at poses (K, 3); 0 off the map."""
    return mean_likelihood(field, source.walls, matrices(poses, source.middle, size))


@njit(cache=True)
def mean_likelihood(
    field: NDArray[np.float32], walls: NDArray[np.float64], matrices: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Average a field (rows, cols), 0 beyond it, over walls (N, 2) moved by each of the matrices (K, 2, 3)."""
    rows, cols = field.shape
    number = len(walls)
    means = np.zeros(len(matrices))
    row_of, col_of = np.empty(number, np.int32), np.empty(number, np.int32)
    for k in range(len(matrices)):
        m = matrices[k]
        for i in range(number):
            x, y = walls[i, 0], walls[i, 1]
            col_of[i] = math.floor(m[0, 0] * x + m[0, 1] * y + m[0, 2])
            row_of[i] = math.floor(m[1, 0] * x + m[1, 1] * y + m[1, 2])
        total = 0.0
        for i in range(number):
            row, col = min(max(row_of[i], 0), rows - 1), min(max(col_of[i], 0), cols - 1)
            inside = (row == row_of[i]) & (col == col_of[i])  # a product and no branch, which would cost more
            total += inside * field[row, col]
        means[k] = total / number
    return means


def _difference(to: Poses, start: Poses) -> Poses:
    """Return the differences of poses (N, 3), angles wrapped to [-pi, pi]."""
    away = to - start
    away[:, 2] = (away[:, 2] + math.pi) % math.tau - math.pi
    return away
