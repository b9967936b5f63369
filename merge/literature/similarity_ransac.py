"""RANSAC of a similarity on matched points, by OpenCV, and MSAC."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.records.proposal import Proposal

ANY_SCALE = ScaleRange(1e-3, 1e3)


@dataclass(frozen=True, eq=False)
class RansacFit:
    """Matched points (M, 2) and (M, 2), the similarity of RANSAC, and a mask (M,) of its inliers."""

    target: NDArray[np.float64]
    source: NDArray[np.float64]
    target_from_source: Similarity2
    inliers: NDArray[np.bool_]

    def proposals(self, scale: ScaleRange) -> tuple[Proposal, ...]:
        """Propose the similarity fitted to the inliers, within the bounds of the scale; none if they determine none."""
        fit = fit_similarity(self.target[self.inliers], self.source[self.inliers], scale)
        if fit is None:
            return ()
        return (Proposal(fit, matches=len(self.inliers), inliers=int(self.inliers.sum())),)


def ransac_similarity(
    target: NDArray[np.float64], source: NDArray[np.float64], inlier_distance_cells: float
) -> RansacFit | None:
    """Run OpenCV's RANSAC for a similarity (Fischler and Bolles 1981), whose seed is fixed; None if it finds none."""
    if len(source) < 3:
        return None
    matrix, inliers = cv2.estimateAffinePartial2D(
        source, target, method=cv2.RANSAC, ransacReprojThreshold=inlier_distance_cells
    )
    if matrix is None or not np.isfinite(matrix).all() or not np.hypot(matrix[0, 0], matrix[1, 0]) > 0.0:
        return None
    return RansacFit(target, source, Similarity2.from_matrix(matrix), inliers.ravel().astype(bool))


def msac_similarity(
    target: NDArray[np.float64],
    source: NDArray[np.float64],
    *,
    samples: int,
    inlier_distance: float,
    rng: np.random.Generator,
) -> RansacFit | None:
    """Find the similarity of least truncated squared distance among samples of two matches, fitted to its inliers.

    ``target`` (M, 2) and ``source`` (M, 2) are matched points. A match costs its squared distance, at most that of an
    inlier: Torr and Zisserman 2000, equation 4. None if no sample determines a similarity.
    """
    if len(source) < 2:
        return None
    there, here = target[:, 0] + 1j * target[:, 1], source[:, 0] + 1j * source[:, 1]
    one = rng.integers(len(here), size=samples)
    other = (one + rng.integers(1, len(here), size=samples)) % len(here)
    useful = (here[one] != here[other]) & (there[one] != there[other])
    one, other = one[useful], other[useful]
    if not len(one):
        return None
    turns = (there[one] - there[other]) / (here[one] - here[other])
    shifts = there[one] - turns * here[one]
    squares = np.square(np.abs(turns[:, None] * here + shifts[:, None] - there))
    best = int(np.minimum(squares, inlier_distance**2).sum(axis=1).argmin())
    inliers = squares[best] <= inlier_distance**2
    turn, shift = complex(turns[best]), complex(shifts[best])
    sampled = Similarity2(shift.real, shift.imag, float(np.angle(turn)), abs(turn))
    fit = fit_similarity(target[inliers], source[inliers], ANY_SCALE)
    return RansacFit(target, source, sampled if fit is None else fit, inliers)
