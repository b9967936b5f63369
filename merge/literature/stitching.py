"""The recipe of m-explore's map_merge: OpenCV's stitching of panoramas, applied to maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.acceptance import accept_by_score, no_answer
from merge.literature.similarity_ransac import RansacFit
from merge.preparation.prepared_map import PreparedMap
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal

LARGEST_SEED = 2**31 - 1

LEAST_SIDE = 32
"""Pixels; smaller pictures are filled up with unknown, since OpenCV's AKAZE overruns memory on the smallest."""

UNKNOWN_BYTE = 255


@dataclass(frozen=True)
class Stitching:
    """Horner 2016, as his ROS package map_merge runs it: AKAZE (Alcantarilla et al. 2013) with OpenCV's defaults,
    ``AffineBestOf2NearestMatcher`` with OpenCV's defaults, and pairs whose confidence falls below 1 left out.

    The confidence is inliers / (8 + 0.3 matches), Brown and Lowe 2007, section 3.2. The picture is the one that the
    package hands to OpenCV: the bytes of nav_msgs/OccupancyGrid, unknown being 255. The package ends with a bundle
    adjustment, which on a pair of maps repeats the fit that the matcher makes of its inliers.

    - ``match_confidence``: matches whose two nearest are less apart than this are dropped;
    - ``least_matches``: fewer are not looked at.
    """

    confidence: float = 1.0
    match_confidence: float = 0.3
    least_matches: int = 6

    def __post_init__(self) -> None:
        if not 0.0 < self.confidence < np.inf:
            raise ValueError(f"Stitching: confidence is {self.confidence}, must be positive and finite")
        if not 0.0 < self.match_confidence < 1.0:
            raise ValueError(f"Stitching: match_confidence is {self.match_confidence}, must lie in (0, 1)")
        if self.least_matches < 3:
            raise ValueError(f"Stitching: least_matches is {self.least_matches}, must be at least 3")

    def describe(self, prepared: PreparedMap) -> Any:
        """Compute OpenCV's ``ImageFeatures`` of the map; their points are cells less one half."""
        picture = np.ascontiguousarray(prepared.grid.occupancy()).view(np.uint8)
        missing = [max(0, LEAST_SIDE - side) for side in picture.shape]
        picture = np.pad(picture, [(0, cells) for cells in missing], constant_values=UNKNOWN_BYTE)
        return cv2.detail.computeImageFeatures2(cv2.AKAZE.create(), picture)

    def propose(self, target: Any, source: Any, scale: ScaleRange, rng: np.random.Generator) -> tuple[Proposal, ...]:
        """Propose the similarity of most inliers, fitted to them within the bounds of the scale."""
        found = self._stitched(target, source, rng)
        return () if found is None else found.matches.proposals(scale)

    def published(self, target: Any, source: Any, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """Return the stitched transform, accepted from ``confidence`` on; its scale is free whatever the range."""
        found = self._stitched(target, source, rng)
        if found is None:
            return no_answer()
        return accept_by_score(
            found.matches.target_from_source, "OpenCV's confidence", found.confidence, self.confidence
        )

    def _stitched(self, target: Any, source: Any, rng: np.random.Generator) -> Stitched | None:
        if min(len(target.getKeypoints()), len(source.getKeypoints())) < 2:
            return None
        cv2.setRNGSeed(int(rng.integers(LARGEST_SEED)))  # the matcher's hash tables draw from OpenCV's own stream
        matcher = cv2.detail.AffineBestOf2NearestMatcher(False, False, self.match_confidence, self.least_matches)
        info = matcher.apply(source, target)
        if info.H is None or not np.isfinite(info.H).all() or not np.hypot(*info.H[:2, 0]) > 0.0:
            return None
        matches = info.getMatches()
        agreed = RansacFit(
            _points(target, [match.trainIdx for match in matches]),
            _points(source, [match.queryIdx for match in matches]),
            _in_cells(np.asarray(info.H, dtype=np.float64)),
            np.array(info.getInliers(), dtype=bool),
        )
        return Stitched(agreed, float(info.confidence))


@dataclass(frozen=True, eq=False)
class Stitched:
    """Matches of OpenCV, in cells, and their confidence."""

    matches: RansacFit
    confidence: float


def _points(features: Any, index: list[int]) -> NDArray[np.float64]:
    keypoints = features.getKeypoints()
    return np.array([keypoints[k].pt for k in index], dtype=np.float64) + 0.5


def _in_cells(matrix: NDArray[np.float64]) -> Similarity2:
    """Convert pixels, centres at integers, rows not flipped, to cells: half a cell is added."""
    half = Similarity2(0.5, 0.5)
    return half @ Similarity2.from_matrix(matrix[:2]) @ half.inverse()
