"""MSAC of a similarity on matched points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.literature.similarity_ransac import RansacFit

ANY_SCALE = ScaleRange(1e-3, 1e3)


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
