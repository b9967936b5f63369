"""Proposals from SIFT features on the map image."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from merge.chart import Chart
from merge.consensus import ConsensusSettings, consensus
from merge.picture import cells_from_pixels, trinary_picture
from merge.proposer import Proposal
from merge.scale_range import ScaleRange


@dataclass(frozen=True, eq=False)
class Features:
    """Keypoints (N, 2), x and y in cells of a :class:`Chart`, and descriptors (N, 128) float32."""

    points: NDArray[np.float64]
    descriptors: NDArray[np.float32]


@dataclass(frozen=True)
class Sift:
    """Chapter 4 of Chen 2021: SIFT (Lowe 2004) on three greys, nearest neighbours by brute force, ratio test, RANSAC.

    ``enable_precise_upscale`` is on, since OpenCV's keypoints are off by a quarter of a pixel without it.
    ``ratio`` is Lowe's own bound, which keeps more right matches than Chen's 0.75; RANSAC bears the wrong ones.
    ``smoothing_cells`` is the standard deviation of a Gaussian that takes the stairs off slanted walls first, which
    look different in every frame; 0 is the method as published.
    """

    ratio: float = 0.8
    smoothing_cells: float = 1.5
    consensus: ConsensusSettings = field(default_factory=ConsensusSettings)

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio <= 1.0:
            raise ValueError(f"Sift: ratio is {self.ratio}, must lie in (0, 1]")
        if not 0.0 <= self.smoothing_cells < np.inf:
            raise ValueError(f"Sift: smoothing_cells is {self.smoothing_cells}, must be finite and not negative")

    def describe(self, chart: Chart) -> Features:
        """The map's features; none on a blank map."""
        picture = trinary_picture(chart.grid)
        if self.smoothing_cells > 0.0:
            picture = cv2.GaussianBlur(picture, (0, 0), self.smoothing_cells).astype(np.uint8)
        keypoints, descriptors = cv2.SIFT.create(enable_precise_upscale=True).detectAndCompute(picture, None)
        if descriptors is None:
            return Features(np.empty((0, 2)), np.empty((0, 128), dtype=np.float32))
        pixels = np.array([keypoint.pt for keypoint in keypoints], dtype=np.float64)
        return Features(cells_from_pixels(pixels, chart.grid.frame.shape[0]), descriptors.astype(np.float32))

    def propose(
        self, target: Features, source: Features, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Similarities that many matched keypoints agree on, most first; empty where too few match."""
        target_index, source_index = match(target.descriptors, source.descriptors, self.ratio)
        pairs = np.hstack((target.points[target_index], source.points[source_index]))
        pairs = np.unique(np.round(pairs, 3), axis=0)  # one keypoint of two orientations counts once
        return consensus(pairs[:, :2], pairs[:, 2:], scale, rng, self.consensus)


def match(
    target: NDArray[np.float32], source: NDArray[np.float32], ratio: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices (M,) and (M,) of descriptors that match: nearest, and nearer than ``ratio`` times the second nearest.

    Source: Lowe 2004, section 7.1.
    """
    if len(target) < 2 or not len(source):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    neighbours = cv2.BFMatcher(cv2.NORM_L2).knnMatch(source, target, k=2)
    kept = [first for first, second in neighbours if first.distance < ratio * second.distance]
    return np.array([m.trainIdx for m in kept], dtype=np.intp), np.array([m.queryIdx for m in kept], dtype=np.intp)
