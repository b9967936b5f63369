"""Chapter 4 of Chen 2021: SIFT features on the map image, as proposals and as published."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.chen2021.ransac import accept_by_index, most_inliers
from merge.literature.published import no_answer
from merge.preparation.map_image import cells_from_pixels, trinary_picture
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.consensus import ConsensusSettings, consensus
from merge.proposers.orb import SMALLEST_SIDE
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal

FeatureName = Literal["sift", "orb"]
Descriptors = NDArray[np.float32] | NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Features:
    """Keypoints (N, 2), x and y in cells of a ``PreparedMap``, and descriptors, (N, 128) float32 of SIFT or (N, 32)
    uint8 of ORB; the grid that they are of."""

    points: NDArray[np.float64]
    descriptors: Descriptors
    grid: OccupancyGrid


@dataclass(frozen=True)
class Sift:
    """Chapter 4 of Chen 2021: SIFT (Lowe 2004) on three greys, nearest neighbours by brute force, ratio test, RANSAC.

    ``precise_upscale``: OpenCV's keypoints are off by a quarter of a pixel without it. ``ratio`` is Lowe's own bound,
    which keeps more right matches than Chen's 0.75; RANSAC bears the wrong ones. ``smoothing_cells`` is the standard
    deviation of a Gaussian that takes the stairs off slanted walls first, which look different in every frame.
    ``feature`` "orb" is the variant of section 4.6.1, ``most_features`` of them.
    """

    feature: FeatureName = "sift"
    ratio: float = 0.8
    smoothing_cells: float = 1.5
    precise_upscale: bool = True
    most_features: int = 2000
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)

    def __post_init__(self) -> None:
        if self.feature not in ("sift", "orb"):
            raise ValueError(f"Sift: feature is {self.feature!r}, must be sift or orb")
        if not 0.0 < self.ratio <= 1.0:
            raise ValueError(f"Sift: ratio is {self.ratio}, must lie in (0, 1]")
        if not 0.0 <= self.smoothing_cells < np.inf:
            raise ValueError(f"Sift: smoothing_cells is {self.smoothing_cells}, must be finite and not negative")
        if self.most_features < 1:
            raise ValueError(f"Sift: most_features is {self.most_features}, must be at least 1")

    @staticmethod
    def as_published(feature: FeatureName = "sift") -> Sift:
        """Return the settings of the thesis: OpenCV's defaults on the bare picture, ratio 0.75, 2000 samples."""
        return Sift(feature, ratio=0.75, smoothing_cells=0.0, precise_upscale=False, most_features=500)

    def describe(self, chart: PreparedMap) -> Features:
        """Detect the map's features; none on a blank map, nor by ORB on a very small one."""
        picture = trinary_picture(chart.grid)
        if self.smoothing_cells > 0.0:
            picture = cv2.GaussianBlur(picture, (0, 0), self.smoothing_cells).astype(np.uint8)
        keypoints, descriptors = self._detected(picture)
        if descriptors is None:
            nothing = np.empty((0, 128), np.float32) if self.feature == "sift" else np.empty((0, 32), np.uint8)
            return Features(np.empty((0, 2)), nothing, chart.grid)
        pixels = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float64)
        return Features(cells_from_pixels(pixels, chart.grid.frame.shape[0]), descriptors, chart.grid)

    def _detected(self, picture: NDArray[np.uint8]) -> tuple[Any, Any]:
        if self.feature == "sift":
            return cv2.SIFT.create(enable_precise_upscale=self.precise_upscale).detectAndCompute(picture, None)
        if min(picture.shape) < SMALLEST_SIDE:
            return (), None
        return cv2.ORB.create(nfeatures=self.most_features).detectAndCompute(picture, None)

    def propose(
        self, target: Features, source: Features, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose similarities with many inliers among the matched keypoints, most first; none if too few match."""
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
        return no_answer() if found is None else accept_by_index(target.grid, source.grid, found)

    def matched(self, target: Features, source: Features) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Match features; return points (M, 2) of the target and (M, 2) of the source."""
        target_index, source_index = match(target.descriptors, source.descriptors, self.ratio)
        return target.points[target_index], source.points[source_index]


def match(target: Descriptors, source: Descriptors, ratio: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match descriptors: nearest, and nearer than ``ratio`` times the second nearest.

    Return indices (M,) into the target and (M,) into the source. Source: Lowe 2004, section 7.1.
    """
    if len(target) < 2 or not len(source):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    norm = cv2.NORM_HAMMING if target.dtype == np.uint8 else cv2.NORM_L2
    neighbours = cv2.BFMatcher(norm).knnMatch(source, target, k=2)
    kept = [first for first, second in neighbours if first.distance < ratio * second.distance]
    return np.array([m.trainIdx for m in kept], dtype=np.intp), np.array([m.queryIdx for m in kept], dtype=np.intp)
