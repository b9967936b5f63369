"""Trimmed and scaling ICP from a start by SIFT, for maps of different resolutions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.chen2021.sift import Features, Sift
from merge.literature.nearest_wall import Complex
from merge.literature.similarity_ransac import msac_similarity
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.records.verdict import Verdict


@dataclass(frozen=True, eq=False)
class EdgeMap:
    """SIFT features of a map, and its wall cells beside free space, as x + i y (N,) in cells."""

    features: Features
    edges: Complex


@dataclass(frozen=True)
class Trimmed:
    """A similarity with the share of the source's edges that it matches, and their objective."""

    target_from_source: Similarity2
    overlap: float
    objective: float


@dataclass(frozen=True)
class ScalingIcp:
    """Ma et al. 2016, "Merging grid maps of different resolutions by scaling registration" (Robotica 34(11)).

    Published: SIFT features (Lowe 2004) whose matches RANSAC finds consistent give a start. The trimmed and scaling ICP
    (TsICP) then pairs every edge point with the nearest of the other map, finds the share of pairs that overlap, fits
    rotation, translation and scale to those, and goes on until they stay.

    Chosen, since only the abstract was at hand: the objective of an overlap is that of the trimmed ICP which TsICP
    extends, its mean squared distance over the overlap to the power of 1 + ``preference`` (Chetverikov et al. 2005,
    equation 8), in units of the source, so that a shrunk source gains nothing; edges are wall cells beside free space;
    the scale keeps to a factor of ``scale_change`` of the start's. The abstract names no acceptance: every answer is
    accepted, and its confidence is the overlap.

    - ``sift``: OpenCV's defaults and Lowe's ratio; ``samples``, ``inlier_distance_cells``: of RANSAC;
    - ``least_overlap``: smallest share of edges that is tried;
    - ``points``: sample of the edges; ``iterations``: most of them.
    """

    sift: Sift = field(default_factory=lambda: Sift(smoothing_cells=0.0, precise_upscale=False))
    samples: int = 2000
    inlier_distance_cells: float = 5.0
    least_overlap: float = 0.3
    preference: float = 2.0
    scale_change: float = 1.2
    points: int = 1500
    iterations: int = 50

    def __post_init__(self) -> None:
        require_valid(self, shares=("least_overlap",))
        if self.scale_change < 1.0:
            raise ValueError(f"ScalingIcp: scale_change is {self.scale_change}, must be at least 1")

    def describe(self, prepared: PreparedMap) -> EdgeMap:
        """Detect the map's features, and collect its edges."""
        points = prepared.points
        return EdgeMap(self.sift.describe(prepared), points[:, 0] + 1j * points[:, 1])

    def propose(
        self, target: EdgeMap, source: EdgeMap, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the registered similarity, its scale clipped to the range about the middle of the source."""
        found = self._registered(target, source, rng)
        if found is None:
            return ()
        middle = np.array([[source.edges.real.mean(), source.edges.imag.mean()]])
        return (Proposal(_with_scale(found.target_from_source, scale.clip(found.target_from_source.scale), middle)),)

    def published(self, target: EdgeMap, source: EdgeMap, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """Return the registered similarity, always accepted; its scale is free whatever the range."""
        found = self._registered(target, source, rng)
        if found is None:
            return no_answer()
        return PairAnswer(found.target_from_source, None, Verdict(True, found.overlap, None))

    def _registered(self, target: EdgeMap, source: EdgeMap, rng: np.random.Generator) -> Trimmed | None:
        there, here = self.sift.matched(target.features, source.features)
        start = msac_similarity(there, here, samples=self.samples, inlier_distance=self.inlier_distance_cells, rng=rng)
        if start is None or min(len(target.edges), len(source.edges)) < 3:
            return None
        return self.register(target.edges, source.edges, start.target_from_source)

    def register(self, target: Complex, source: Complex, start: Similarity2) -> Trimmed:
        """Run TsICP on edges (N,) and (M,) from a start, target from source."""
        from scipy.spatial import cKDTree  # here: loading it takes a tenth of a merge, and other methods do without

        kept = np.linspace(0, len(source) - 1, min(len(source), self.points)).astype(np.intp)
        sample = np.stack((source[kept].real, source[kept].imag), axis=-1)
        bounds = ScaleRange(start.scale / self.scale_change, start.scale * self.scale_change)
        there = np.stack((target.real, target.imag), axis=-1)
        walls = cKDTree(there)
        best = Trimmed(start, 1.0, np.inf)
        transform = start
        for _ in range(self.iterations):
            distances, nearest = walls.query(transform.apply(sample))
            squares = np.square(distances / transform.scale)
            order = np.argsort(squares, kind="stable")
            number, objective = self.best_overlap(squares[order])
            if not objective < best.objective:
                break
            best = Trimmed(transform, number / len(order), objective)
            paired = order[:number]
            fit = fit_similarity(there[np.asarray(nearest)[paired]], sample[paired], bounds)
            if fit is None:
                break
            transform = fit
        return best

    def best_overlap(self, squares: NDArray[np.float64]) -> tuple[int, float]:
        """Return the number of pairs that minimises the objective, and its value; ``squares`` (N,) must be sorted."""
        numbers = np.arange(1, len(squares) + 1)
        objectives = np.cumsum(squares) / numbers / (numbers / len(squares)) ** (1.0 + self.preference)
        first = max(2, int(np.ceil(self.least_overlap * len(squares)))) - 1
        best = first + int(objectives[first:].argmin())
        return best + 1, float(objectives[best])


def _with_scale(transform: Similarity2, size: float, middle: NDArray[np.float64]) -> Similarity2:
    """Change the scale of a transform so that a point (1, 2) of the source stays where it is."""
    turned = Similarity2(yaw=transform.yaw, scale=size)
    x, y = (transform.apply(middle) - turned.apply(middle))[0]
    return Similarity2(float(x), float(y), transform.yaw, size)
