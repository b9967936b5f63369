"""Iterative closest points from many starts."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.nearest_wall import Complex, NearestWall
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import centres
from merge.progress import track
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.records.verdict import Reason, Refusal, Verdict


@dataclass(frozen=True, eq=False)
class Shape:
    """The wall cells of a map, centres (N,) in cells, and a sample of them (M,)."""

    points: Complex
    sample: Complex


@dataclass(frozen=True)
class Icp:
    """Besl and McKay 1992, "A method for registration of 3-D shapes", in the plane and from many initial states.

    Each state pairs every data point with the nearest model point, moves the data by the rotation and translation of
    least squares, and goes on until the mean square distance falls by less than ``least_fall`` of itself (section
    IV). The local minimum of least mean square distance over all initial rotations and translations wins (section
    V). Rigid: the scale is the middle of the range. Nearest points are looked up in a raster (``NearestWall``),
    which in one of a thousand cases returns another that is hardly farther.

    - ``rotations``, ``shifts``: states start at so many rotations, and at a square of so many shifts a
      side over the model's box;
    - ``points``: sample of the data points;
    - ``most_rms_cells``: an answer is accepted if the root mean square distance is below.
    """

    rotations: int = 24
    shifts: int = 3
    points: int = 150
    iterations: int = 40
    least_fall: float = 1e-3
    most_rms_cells: float = 1.5
    proposals: int = 72

    def __post_init__(self) -> None:
        require_valid(self)

    def describe(self, prepared: PreparedMap) -> Shape:
        """Collect the map's walls, and an even sample of them."""
        cells = centres(prepared.grid.occupied)
        points = cells[:, 0] + 1j * cells[:, 1]
        kept = np.linspace(0, len(points) - 1, min(len(points), self.points)).astype(np.intp)
        return Shape(points, points[kept])

    def propose(
        self, target: Shape, source: Shape, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the final states, least mean square distance first; none if a map has less than three wall cells."""
        if min(len(target.points), len(source.points)) < 3:
            return ()
        turns, shifts, _ = self._ended(target, source, scale.middle)
        ended = zip(turns[: self.proposals], shifts[: self.proposals], strict=True)
        return tuple(Proposal(_similarity(turn, shift)) for turn, shift in ended)

    def published(self, target: Shape, source: Shape, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """Return the state with the least mean square distance, accepted if its root is within the bound."""
        if min(len(target.points), len(source.points)) < 3:
            return no_answer()
        turns, shifts, errors = self._ended(target, source, scale.middle)
        rms, most = math.sqrt(errors[0]), self.most_rms_cells
        text = f"the RMS distance is {rms:.1f} cells, {most:g} are allowed"
        refusal = None if rms <= most else Refusal(Reason.PUBLISHED_RULE, text)
        return PairAnswer(_similarity(turns[0], shifts[0]), None, Verdict(rms <= most, most / (most + rms), refusal))

    def _ended(self, target: Shape, source: Shape, size: float) -> tuple[Complex, Complex, NDArray[np.float64]]:
        """Run every state until it converges. Returns rotations, shifts and mean square distances [target cells],
        sorted by distance."""
        walls = NearestWall.of(target.points, size * _reach(source))
        turns, shifts = self._initial_states(target, source, size)
        errors = np.full(len(turns), np.inf)
        going = np.arange(len(turns))
        for _ in track(range(self.iterations), "iterations"):
            moved = turns[going, None] * source.sample + shifts[going, None]
            distance, nearest = walls.query(moved)
            mean_square = np.mean(np.square(distance), axis=1)
            falling = errors[going] - mean_square > self.least_fall * mean_square
            errors[going] = mean_square
            turns[going], shifts[going] = fit_rigid(target.points[nearest], source.sample, size)
            going = going[falling]
            if not len(going):
                break
        order = np.argsort(errors, kind="stable")
        return turns[order], shifts[order], errors[order]

    def _initial_states(self, target: Shape, source: Shape, size: float) -> tuple[Complex, Complex]:
        yaws = np.arange(self.rotations) * (math.tau / self.rotations)
        steps = (np.arange(self.shifts) + 0.5) / self.shifts
        across, up = np.ptp(target.points.real) * steps, np.ptp(target.points.imag) * steps
        places = target.points.real.min() + across[:, None] + 1j * (target.points.imag.min() + up[None, :])
        turns = np.repeat(size * np.exp(1j * yaws), places.size)
        return turns, np.tile(places.ravel(), self.rotations) - turns * source.points.mean()


def _reach(data: Shape) -> float:
    """Bound the distance of data points from the model's box, which their mean never leaves."""
    middle = data.sample.mean()
    return float(np.abs(data.sample - middle).max() + abs(data.points.mean() - middle))


def fit_rigid(target: Complex, source: Complex, size: float) -> tuple[Complex, Complex]:
    """Fit rotations (K,), of length ``size``, and shifts (K,) by least squares to the partners (K, N) of points (N,).

    Source: Besl and McKay 1992, section III.C; in the plane the quaternion is one complex number.
    """
    middle, middles = complex(source.mean()), target.mean(axis=1)
    covariance: Complex = np.einsum("kn,n->k", target - middles[:, None], (source - middle).conj())
    length = np.abs(covariance)
    turns = np.full(len(covariance), complex(size))
    turns[length > 0.0] *= covariance[length > 0.0] / length[length > 0.0]
    return turns, middles - turns * middle


def _similarity(turn: complex, shift: complex) -> Similarity2:
    return Similarity2(float(shift.real), float(shift.imag), float(np.angle(turn)), float(abs(turn)))
