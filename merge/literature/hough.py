"""Map merging by Hough spectra: rotation from wall directions, translation from projections."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.literature.acceptance import accept_by_score, no_answer
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import centres
from merge.progress import track
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.verification.cell_overlap import compare_cells

DEGREES = 360


@dataclass(frozen=True, eq=False)
class WallCells:
    """A map, the centres of its occupied cells (N, 2) in cells, and their Hough spectrum (360,)."""

    grid: OccupancyGrid
    points: NDArray[np.float64]
    spectrum: NDArray[np.float64]


@dataclass(frozen=True)
class Hough:
    """Carpin 2008, "Fast and accurate map merging for multi-robot systems", in its robust variant.

    The Hough spectrum of either map is correlated over rotation; each of the highest ``rotations`` local maxima, and
    its neighbours a degree away, is a hypothesis. The target is rotated so that its main walls lie along the axes, and
    each hypothesis gets its translation from the projections of the walls on the two axes. The acceptance index of
    Birk and Carpin 2006 ranks hypotheses. Rigid: the scale is the middle of the range.

    Walls are points here instead of pixels of rotated images, so that a rotation loses none. ``acceptance_index`` is
    the least one of an accepted answer: 98 %, as in Birk and Carpin 2006.
    """

    rotations: int = 4
    acceptance_index: float = 0.98

    def __post_init__(self) -> None:
        require_valid(self)
        if self.acceptance_index > 1.0:
            raise ValueError(f"Hough: acceptance_index is {self.acceptance_index}, must lie in (0, 1]")

    def describe(self, prepared: PreparedMap) -> WallCells:
        """Collect the map's walls and their spectrum."""
        points = centres(prepared.grid.occupied)
        return WallCells(prepared.grid, points, hough_spectrum(points))

    def propose(
        self, target: WallCells, source: WallCells, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose all hypotheses, highest acceptance index first; none if a map has no wall."""
        return tuple(Proposal(transform) for _, transform in self._hypotheses(target, source, scale.middle))

    def published(
        self, target: WallCells, source: WallCells, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the hypothesis of the highest acceptance index."""
        found = self._hypotheses(target, source, scale.middle)
        if not found:
            return no_answer()
        return accept_by_score(found[0][1], "the acceptance index", found[0][0], self.acceptance_index)

    def _hypotheses(self, target: WallCells, source: WallCells, size: float) -> list[tuple[float, Similarity2]]:
        if not len(target.points) or not len(source.points):
            return []
        main = math.radians(int(target.spectrum.argmax()))
        found = []
        peaks = highest_maxima(circular_correlation(target.spectrum, source.spectrum), self.rotations)
        for peak in track(peaks, "rotations"):
            for degrees in (peak, peak + 1, peak - 1):
                transform = _shifted(target.points, source.points, main, math.radians(degrees), size)
                index = compare_cells(target.grid, source.grid, transform).acceptance_index
                found.append((0.0 if index is None else index, transform))
        return sorted(found, key=lambda hypothesis: -hypothesis[0])


def hough_spectrum(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute HS(theta) = sum over rho of HT(rho, theta)^2, (360,) in steps of a degree; zeros without points.

    ``points`` (N, 2) vote for the lines rho = x cos theta + y sin theta through them, rho in whole cells. Source:
    Carpin 2008. The spectrum does not change with a translation and rotates with the points, up to rounding. Its period
    is 180 degrees, because theta + 180 names the same lines.
    """
    if not len(points):
        return np.zeros(DEGREES)
    theta = np.radians(np.arange(DEGREES // 2))
    about = points - points.mean(axis=0)
    rho = np.rint(np.cos(theta)[:, None] * about[:, 0] + np.sin(theta)[:, None] * about[:, 1]).astype(np.int64)
    rho -= rho.min()
    lines = int(rho.max()) + 1
    votes = np.bincount((np.arange(len(theta))[:, None] * lines + rho).ravel(), minlength=len(theta) * lines)
    squares: NDArray[np.float64] = (votes.reshape(len(theta), lines).astype(np.float64) ** 2).sum(axis=1)
    return np.tile(squares, 2)


def circular_correlation(target: NDArray[np.float64], source: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute CC(k) = sum over i of target(i + k) source(i), (360,), indices modulo 360: Carpin 2008.

    It peaks at the degrees by which the source must be rotated to match the target.
    """
    spectrum = np.fft.rfft(target) * np.conj(np.fft.rfft(source))
    return np.fft.irfft(spectrum, len(target)).astype(np.float64)


def highest_maxima(values: NDArray[np.float64], number: int) -> list[int]:
    """Return the indices of the highest circular local maxima, highest first; the first of a plateau."""
    peaks = np.flatnonzero((values > np.roll(values, 1)) & (values >= np.roll(values, -1)))
    return [int(k) for k in peaks[np.argsort(-values[peaks], kind="stable")[:number]]]


def _shifted(
    target: NDArray[np.float64], source: NDArray[np.float64], main: float, yaw: float, size: float
) -> Similarity2:
    """Add to a rotation the translation by which the projections along and across the main walls correlate best."""
    upright = Similarity2(yaw=-main)
    turned = upright @ Similarity2(yaw=yaw, scale=size)
    there, here = upright.apply(target), turned.apply(source)
    shift = [projection_shift(there[:, axis], here[:, axis]) for axis in (0, 1)]
    return upright.inverse() @ Similarity2(shift[0], shift[1]) @ turned


def projection_shift(target: NDArray[np.float64], source: NDArray[np.float64]) -> float:
    """Return the whole cells by which the source must be shifted to correlate best with the target.

    Carpin 2008: the X-spectrum (Y-spectrum) counts walls in each column (row), and two are cross-correlated.
    ``target`` (N,) and ``source`` (M,) are coordinates of the walls on one axis.
    """
    first, last = math.floor(target.min()), math.floor(source.min())
    counts = [np.bincount(np.floor(x).astype(np.int64) - low) for x, low in ((target, first), (source, last))]
    correlation = np.correlate(counts[0].astype(np.float64), counts[1].astype(np.float64), mode="full")
    return float(first - last + int(correlation.argmax()) - (len(counts[1]) - 1))
