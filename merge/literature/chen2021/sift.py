"""Chapter 4 of Chen 2021: SIFT features on the map image, as proposals and as published."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.chen2021.ransac import accept_by_index, most_inliers
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.consensus import ConsensusSettings, consensus
from merge.proposers.keypoints import Descriptors, Keypoints, detect_orb, match_descriptors
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.verification.cell_overlap import compare_cells

FeatureName = Literal["sift", "orb"]


@dataclass(frozen=True, eq=False)
class Features(Keypoints):
    """Keypoints, and the grid that they are of."""

    grid: OccupancyGrid


@dataclass(frozen=True)
class Sift:
    """Chapter 4 of Chen 2021: SIFT (Lowe 2004) on three greys, nearest neighbours by brute force, ratio test, RANSAC.

    ``precise_upscale``: OpenCV's keypoints are off by a quarter of a pixel without it. ``ratio`` is Lowe's own bound,
    which keeps more right matches than Chen's 0.75; RANSAC bears the wrong ones. ``smoothing_cells`` is the standard
    deviation of a Gaussian that takes the stairs off slanted walls first, which look different in every frame.
    ``feature`` "orb" is the variant of section 4.6.1, ``most_features`` of them. An answer as published
    is refused if one map would be more than ``max_scale`` times as large as the other.
    """

    feature: FeatureName = "sift"
    ratio: float = 0.8
    smoothing_cells: float = 1.5
    precise_upscale: bool = True
    most_features: int = 2000
    max_scale: float = 10.0
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)

    def __post_init__(self) -> None:
        if self.feature not in ("sift", "orb"):
            raise ValueError(f"Sift: feature is {self.feature!r}, must be sift or orb")
        require_valid(self, shares=("ratio",), not_negative=("smoothing_cells",))

    @staticmethod
    def as_published(feature: FeatureName = "sift") -> Sift:
        """Return the settings of the thesis: OpenCV's defaults on the bare picture, ratio 0.75, 2000 samples."""
        return Sift(feature, ratio=0.75, smoothing_cells=0.0, precise_upscale=False, most_features=500)

    def describe(self, prepared: PreparedMap) -> Features:
        """Detect the map's features; none on a blank map, nor by ORB on a very small one."""
        picture = trinary_picture(prepared.grid)
        if self.smoothing_cells > 0.0:
            picture = cv2.GaussianBlur(picture, (0, 0), self.smoothing_cells).astype(np.uint8)
        pixels, descriptors = self._detected(picture)
        return Features(cells_from_pixels(pixels, prepared.grid.frame.shape[0]), descriptors, prepared.grid)

    def _detected(self, picture: NDArray[np.uint8]) -> tuple[NDArray[np.float64], Descriptors]:
        if self.feature == "orb":
            return detect_orb(picture, cv2.ORB.create(nfeatures=self.most_features))
        sift = cv2.SIFT.create(enable_precise_upscale=self.precise_upscale)
        keypoints, descriptors = sift.detectAndCompute(picture, None)
        if descriptors is None:
            return np.empty((0, 2)), np.empty((0, 128), np.float32)
        return np.array([keypoint.pt for keypoint in keypoints], np.float64), descriptors.astype(np.float32)

    def propose(
        self, target: Features, source: Features, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose similarities by falling number of inliers among the matched keypoints; none if too few match."""
        matched = self.matched(target, source)
        pairs = np.asarray(
            np.unique(np.round(np.hstack(matched), 3), axis=0), np.float64
        )  # one keypoint of two orientations counts once
        return consensus(pairs[:, :2], pairs[:, 2:], scale, rng, self.consensus)

    def published(self, target: Features, source: Features, scale: ScaleRange, rng: np.random.Generator) -> PairAnswer:
        """Return the sample of two matches with most inliers, not fitted again, accepted by its acceptance index alone.

        Its scale is free whatever the range.
        """
        settings = self.consensus
        found = most_inliers(*self.matched(target, source), settings.samples, settings.inlier_distance_cells, rng)
        if found is None:
            return no_answer()
        index = compare_cells(target.grid, source.grid, found).acceptance_index
        return accept_by_index(found, index, self.max_scale)

    def matched(self, target: Features, source: Features) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Match features; return points (M, 2) of the target and (M, 2) of the source."""
        target_index, source_index = match_descriptors(target.descriptors, source.descriptors, self.ratio)
        return target.points[target_index], source.points[source_index]
