"""Chapter 4 of Chen 2021: SIFT features on the map image, as proposals and as published."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.chen2021.ransac import accept_by_index, most_inliers
from merge.preparation.map_image import FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY, cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.consensus import ConsensusSettings, consensus
from merge.proposers.keypoints import Descriptors, Keypoints, detect_orb, match_descriptors
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.verification.cell_overlap import compare_cells

FeatureName = Literal["sift", "orb", "fast_brisk"]
Greys = Literal["three", "two", "all"]
FEATURES, GREYS = get_args(FeatureName), get_args(Greys)


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
    ``feature`` "orb" is a variant of section 4.6.1, ``most_features`` of them; "fast_brisk" another, BRISK's
    descriptors of FAST corners. ``greys``: "three" as in section 4.1; "two", walls and all else; or "all", a grey for
    each probability (appendix A). An answer as published is refused if one map would be more than ``max_scale`` times
    as large as the other.
    """

    feature: FeatureName = "sift"
    greys: Greys = "three"
    ratio: float = 0.8
    smoothing_cells: float = 1.5
    precise_upscale: bool = True
    most_features: int = 2000
    max_scale: float = 10.0
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)

    def __post_init__(self) -> None:
        for name, known in (("feature", FEATURES), ("greys", GREYS)):
            if getattr(self, name) not in known:
                raise ValueError(f"Sift: {name} is {getattr(self, name)!r}, must be one of {', '.join(known)}")
        require_valid(self, shares=("ratio",), not_negative=("smoothing_cells",))

    @staticmethod
    def as_published(feature: FeatureName = "sift", greys: Greys = "three") -> Sift:
        """Return the settings of the thesis: OpenCV's defaults on the bare picture, ratio 0.75, 2000 samples."""
        return Sift(feature, greys, ratio=0.75, smoothing_cells=0.0, precise_upscale=False, most_features=500)

    def describe(self, prepared: PreparedMap) -> Features:
        """Detect the map's features; none on a blank map, nor by ORB on a very small one."""
        picture = _picture(prepared.grid, self.greys)
        if self.smoothing_cells > 0.0:
            picture = cv2.GaussianBlur(picture, (0, 0), self.smoothing_cells).astype(np.uint8)
        pixels, descriptors = self.detect(picture)
        return Features(cells_from_pixels(pixels, prepared.grid.frame.shape[0]), descriptors, prepared.grid)

    def detect(self, picture: NDArray[np.uint8]) -> tuple[NDArray[np.float64], Descriptors]:
        """Detect the features of a grey picture: pixels (N, 2) u, v and their descriptors."""
        if self.feature == "orb":
            return detect_orb(picture, cv2.ORB.create(nfeatures=self.most_features))
        if self.feature == "fast_brisk":
            corners = cv2.FastFeatureDetector.create().detect(picture)
            keypoints, descriptors = cv2.BRISK.create().compute(picture, corners)
        else:
            sift = cv2.SIFT.create(enable_precise_upscale=self.precise_upscale)
            keypoints, descriptors = sift.detectAndCompute(picture, None)
        if descriptors is None:
            return np.empty((0, 2)), np.empty((0, 128), np.float32)
        typed = descriptors.astype(np.uint8) if self.feature == "fast_brisk" else descriptors.astype(np.float32)
        return np.array([keypoint.pt for keypoint in keypoints], np.float64), typed

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
        found = self.sampled(target, source, rng)
        if found is None:
            return no_answer()
        index = compare_cells(target.grid, source.grid, found).acceptance_index
        return accept_by_index(found, index, self.max_scale)

    def sampled(self, target: Features, source: Features, rng: np.random.Generator) -> Similarity2 | None:
        """Return the sample of two matches with most inliers; None if there is none."""
        settings = self.consensus
        return most_inliers(*self.matched(target, source), settings.samples, settings.inlier_distance_cells, rng)

    def matched(self, target: Features, source: Features) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Match features; return points (M, 2) of the target and (M, 2) of the source."""
        target_index, source_index = match_descriptors(target.descriptors, source.descriptors, self.ratio)
        return target.points[target_index], source.points[source_index]


def _picture(grid: OccupancyGrid, greys: Greys) -> NDArray[np.uint8]:
    if greys == "all":
        free = 1.0 / (1.0 + np.exp(np.clip(grid.log_odds[::-1].astype(np.float64), -30.0, 30.0)))
        picture = np.rint(free * (FREE_GREY - OCCUPIED_GREY) + OCCUPIED_GREY)
        return np.where(grid.known[::-1], picture, UNKNOWN_GREY).astype(np.uint8)
    picture = trinary_picture(grid)
    return (
        picture if greys == "three" else np.where(picture == OCCUPIED_GREY, OCCUPIED_GREY, FREE_GREY).astype(np.uint8)
    )
