"""Proposals from ORB features on the map image and on a picture of the depth of free space."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.validation import require_valid
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.consensus import ConsensusSettings, consensus
from merge.proposers.keypoints import Keypoints, detect_orb, match_descriptors
from merge.records.proposal import Proposal


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
            index_there, index_here = match_descriptors(there.descriptors, here.descriptors, self.ratio)
            found += consensus(there.points[index_there], here.points[index_here], scale, rng, self.consensus)
        return tuple(found)

    def _detect(self, picture: NDArray[np.uint8], size: int, rows: int) -> Keypoints:
        pixels, descriptors = detect_orb(picture, cv2.ORB.create(nfeatures=self.features, fastThreshold=10))
        return Keypoints(cells_from_pixels(size * (pixels + 0.5) - 0.5, rows), descriptors)


def _depth_picture(prepared: PreparedMap, white_share: float) -> NDArray[np.uint8]:
    rows, cols = prepared.grid.frame.shape
    margin = prepared.margin
    depth = prepared.depth[margin : margin + rows, margin : margin + cols][::-1]
    grey = np.minimum(255.0, depth * (255.0 / max(1.0, white_share * prepared.diagonal))).astype(np.uint8)
    even = np.pad(grey, ((0, rows % 2), (0, cols % 2)))
    return np.asarray(cv2.resize(even, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
