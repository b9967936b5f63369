"""KAZE keypoints with SIFT descriptors on the picture of what is surely free."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.validation import require_valid
from merge.literature.acceptance import no_answer
from merge.literature.similarity_ransac import RansacFit, msac_similarity
from merge.preparation.map_image import cells_from_pixels
from merge.preparation.prepared_map import PreparedMap
from merge.proposers.keypoints import Keypoints
from merge.records.pair_answer import PairAnswer
from merge.records.proposal import Proposal
from merge.records.verdict import Verdict

LARGEST_SQUARE = 4.0
"""Squared distance of two opposite descriptors of length 1."""

SIFT_SIGMA, SIFT_LAYERS = 1.6, 3
"""Blur of the first layer of SIFT [pixels], and layers of an octave: OpenCV's defaults."""

LEAST_SIDE = 32
"""Pixels; smaller pictures have no octaves to diffuse."""


@dataclass(frozen=True)
class KazeSift:
    """Sunil et al. 2023, "Feature-based occupancy map-merging for collaborative SLAM" (Sensors 23(6):3114).

    Published, and the same in the authors' program: the picture is white where a cell is free with a probability of at
    least 0.99 and black elsewhere; KAZE keypoints (Alcantarilla et al. 2012), with SIFT descriptors; nearest neighbours
    that are unique; a similarity by MSAC.

    Chosen: maps of three values know no probability, so that every free cell is white. The program leaves all
    parameters to MATLAB; the fields below are its defaults, as documented, and OpenCV's functions stand in for its.
    The program accepts every answer. The article has a check of the transform as well, which the program lacks; it is
    not reproduced, and the confidence is the share of inliers.

    - ``threshold``, ``octaves``, ``levels``: of KAZE; its diffusivity is the one that prefers wide regions (g2);
    - ``match_share``: greatest squared distance of matched descriptors, as a share of the greatest there is;
    - ``ratio``: greatest ratio of the squared distances to the nearest and the second nearest;
    - ``samples``, ``inlier_distance_cells``: of MSAC.
    """

    threshold: float = 1e-4
    octaves: int = 3
    levels: int = 4
    match_share: float = 0.01
    ratio: float = 0.6
    samples: int = 1000
    inlier_distance_cells: float = 1.5

    def __post_init__(self) -> None:
        require_valid(self, shares=("match_share", "ratio"))

    def describe(self, prepared: PreparedMap) -> Keypoints:
        """Detect the map's keypoints; none on a blank or very small map."""
        picture = np.ascontiguousarray(np.where(prepared.grid.free[::-1], 255, 0).astype(np.uint8))
        nothing = Keypoints(np.empty((0, 2)), np.empty((0, 128), np.float32))
        if min(picture.shape) < LEAST_SIDE:
            return nothing
        kaze = cv2.KAZE.create(False, False, self.threshold, self.octaves, self.levels, cv2.KAZE_DIFF_PM_G2)
        keypoints, _ = kaze.detectAndCompute(picture, None)  # its descriptors come with the orientations
        if not keypoints:
            return nothing
        keypoints, descriptors = cv2.SIFT.create().compute(picture, [in_sift_pyramid(each) for each in keypoints])
        pixels = np.array([keypoint.pt for keypoint in keypoints], np.float64)
        return Keypoints(cells_from_pixels(pixels, picture.shape[0]), unit_length(descriptors.astype(np.float32)))

    def propose(
        self, target: Keypoints, source: Keypoints, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose the similarity of MSAC, fitted to its inliers within the bounds of the scale."""
        found = self._found(target, source, rng)
        return () if found is None else found.proposals(scale)

    def published(
        self, target: Keypoints, source: Keypoints, scale: ScaleRange, rng: np.random.Generator
    ) -> PairAnswer:
        """Return the similarity of MSAC, always accepted; its scale is free whatever the range."""
        found = self._found(target, source, rng)
        if found is None:
            return no_answer()
        return PairAnswer(found.target_from_source, None, Verdict(True, float(found.inliers.mean()), None))

    def _found(self, target: Keypoints, source: Keypoints, rng: np.random.Generator) -> RansacFit | None:
        there, here = self.matched(target, source)
        return msac_similarity(
            target.points[there],
            source.points[here],
            samples=self.samples,
            inlier_distance=self.inlier_distance_cells,
            rng=rng,
        )

    def matched(self, target: Keypoints, source: Keypoints) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Match descriptors both ways; return indices (M,) into the target and (M,) into the source."""
        forth, back = self._nearest(source, target), self._nearest(target, source)
        here = np.array([k for k, nearest in forth.items() if back.get(nearest) == k], np.intp)
        return np.array([forth[k] for k in here.tolist()], np.intp), here

    def _nearest(self, query: Keypoints, train: Keypoints) -> dict[int, int]:
        """Find the nearest neighbour of each descriptor that passes both bounds."""
        if len(query.points) < 1 or len(train.points) < 2:
            return {}
        neighbours = cv2.BFMatcher(cv2.NORM_L2).knnMatch(query.descriptors, train.descriptors, k=2)
        most = self.match_share * LARGEST_SQUARE
        return {
            first.queryIdx: first.trainIdx
            for first, second in neighbours
            if first.distance**2 <= most and first.distance**2 <= self.ratio * second.distance**2
        }


def in_sift_pyramid(keypoint: cv2.KeyPoint) -> cv2.KeyPoint:
    """Place a keypoint in the octave and layer of SIFT's pyramid that is blurred as much as the keypoint is large.

    Its size is twice its standard deviation; OpenCV packs the layer into the second byte of the octave.
    """
    doublings = math.log2(max(keypoint.size / 2.0 / SIFT_SIGMA, 1.0))
    octave = int(doublings)
    layer = round(SIFT_LAYERS * (doublings - octave))
    placed = cv2.KeyPoint(keypoint.pt[0], keypoint.pt[1], keypoint.size, keypoint.angle)
    placed.octave = octave | (layer << 8)
    return placed


def unit_length(descriptors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Divide each descriptor (N, D) by its length, but for those of length 0."""
    lengths = np.linalg.norm(descriptors, axis=1, keepdims=True)
    return (descriptors / np.where(lengths > 0.0, lengths, 1.0)).astype(np.float32)
