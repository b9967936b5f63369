"""Proposals from ORB features on the map image and on a picture of the depth of free space."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.consensus import ConsensusSettings, consensus
from merge.records.proposal import Proposal
from merge.records.validation import require_valid

SMALLEST_SIDE = 63
"""Pixels from the border that ORB leaves out on either side, and one between; smaller pictures trouble OpenCV."""


@dataclass(frozen=True, eq=False)
class Keypoints:
    """Keypoints (N, 2), x and y in cells of a ``PreparedMap``, and descriptors (N, 32) uint8."""

    points: NDArray[np.float64]
    descriptors: NDArray[np.uint8]


@dataclass(frozen=True)
class Orb:
    """ORB (Rublee et al. 2011) on two pictures, ratio test, two-point hypotheses by ``consensus``.

    The second picture, half as large, shows the distance from free cells to the nearest other cell: it changes little
    if walls are ragged.

    - ``features``: keypoints of a picture; ``ratio``: the nearest descriptor must be nearer than this times the second
      nearest (Lowe 2004);
    - ``white_depth_share`` [of the diagonal]: free space so deep is white in the second picture;
    - ``consensus``: hypotheses from the matches.
    """

    features: int = 1500
    ratio: float = 0.9
    white_depth_share: float = 0.05
    consensus: ConsensusSettings = field(
        default_factory=lambda: ConsensusSettings(samples=4000, inlier_distance_cells=4.0, proposals=6)
    )

    def __post_init__(self) -> None:
        require_valid(self, shares=("ratio",))

    def describe(self, prepared: PreparedMap) -> tuple[Keypoints, ...]:
        """Detect the keypoints of both pictures."""
        rows = prepared.grid.frame.shape[0]
        return tuple(
            self._detect(picture, size, rows)
            for picture, size in (
                (trinary_picture(prepared.grid), 1),
                (_depth_picture(prepared, self.white_depth_share), 2),
            )
        )

    def propose(
        self, target: tuple[Keypoints, ...], source: tuple[Keypoints, ...], scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose similarities with many inliers among the matched keypoints of one picture."""
        found: list[Proposal] = []
        for there, here in zip(target, source, strict=True):
            index_there, index_here = match_bits(there.descriptors, here.descriptors, self.ratio)
            found += consensus(there.points[index_there], here.points[index_here], scale, rng, self.consensus)
        return tuple(found)

    def _detect(self, picture: NDArray[np.uint8], size: int, rows: int) -> Keypoints:
        if min(picture.shape) < SMALLEST_SIDE:
            return Keypoints(np.empty((0, 2)), np.empty((0, 32), dtype=np.uint8))
        orb = cv2.ORB.create(nfeatures=self.features, fastThreshold=10)
        keypoints, descriptors = orb.detectAndCompute(picture, None)
        if descriptors is None:
            return Keypoints(np.empty((0, 2)), np.empty((0, 32), dtype=np.uint8))
        pixels = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float64)
        return Keypoints(cells_from_pixels(size * (pixels + 0.5) - 0.5, rows), descriptors.astype(np.uint8))


def match_bits(
    target: NDArray[np.uint8], source: NDArray[np.uint8], ratio: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match bit descriptors: nearest by Hamming distance, and nearer than ``ratio`` times the second nearest.

    Return indices (M,) into the target and (M,) into the source.
    """
    if len(target) < 2 or not len(source):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    neighbours = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(source, target, k=2)
    kept = [first for first, second in neighbours if first.distance < ratio * second.distance]
    return np.array([m.trainIdx for m in kept], dtype=np.intp), np.array([m.queryIdx for m in kept], dtype=np.intp)


def _depth_picture(prepared: PreparedMap, white_share: float) -> NDArray[np.uint8]:
    rows, cols = prepared.grid.frame.shape
    margin = prepared.margin
    depth = prepared.depth[margin : margin + rows, margin : margin + cols][::-1]
    grey = np.minimum(255.0, depth * (255.0 / max(1.0, white_share * prepared.diagonal))).astype(np.uint8)
    even = np.pad(grey, ((0, rows % 2), (0, cols % 2)))
    return np.asarray(cv2.resize(even, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
