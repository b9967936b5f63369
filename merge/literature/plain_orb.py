"""Plain ORB features with RANSAC."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.validation import require_valid
from merge.literature.acceptance import accept_by_score, no_answer
from merge.literature.similarity_ransac import RansacFit, ransac_similarity
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.keypoints import Keypoints, detect_orb
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal


@dataclass(frozen=True)
class PlainOrb:
    """ORB (Rublee et al. 2011) on three greys, brute-force Hamming matching with cross check, OpenCV's RANSAC.

    Not to be confused with ``Orb``, a proposer of ``quilt``. ``min_inliers`` is the number of matches that OpenCV's
    tutorial on features and homographies asks for.
    """

    features: int = 2000
    inlier_distance_cells: float = 3.0
    min_inliers: int = 10

    def __post_init__(self) -> None:
        require_valid(self)

    def describe(self, prepared: PreparedMap) -> Keypoints:
        """Detect the map's keypoints; none on a blank or very small map."""
        picture = trinary_picture(prepared.grid)
        pixels, descriptors = detect_orb(picture, cv2.ORB.create(nfeatures=self.features))
        return Keypoints(cells_from_pixels(pixels, picture.shape[0]), descriptors)

    def propose(
        self, target: Keypoints, source: Keypoints, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the similarity of most inliers, fitted to them within the bounds of the scale."""
        found = self._found(target, source)
        return () if found is None else found.proposals(scale)

    def published(
        self, target: Keypoints, source: Keypoints, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the similarity of RANSAC, accepted from ``min_inliers`` on; its scale is free whatever the range."""
        found = self._found(target, source)
        if found is None:
            return no_answer()
        inliers = float(found.inliers.sum())
        return accept_by_score(found.target_from_source, "the number of inliers", inliers, self.min_inliers)

    def _found(self, target: Keypoints, source: Keypoints) -> RansacFit | None:
        if not len(target.points) or not len(source.points):
            return None
        matches = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(source.descriptors, target.descriptors)
        there = target.points[[match.trainIdx for match in matches]]
        here = source.points[[match.queryIdx for match in matches]]
        return ransac_similarity(there, here, self.inlier_distance_cells)
