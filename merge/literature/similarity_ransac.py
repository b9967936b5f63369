"""OpenCV's RANSAC of a similarity on matched points."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.records.proposal import Proposal


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
