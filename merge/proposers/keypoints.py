"""Keypoints with descriptors, and their matches."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Descriptors = NDArray[np.float32] | NDArray[np.uint8]
"""(N, 128) float32 of SIFT, or (N, 32) uint8 of ORB."""

SMALLEST_SIDE = 63
"""Pixels from the border that ORB leaves out on either side, and one between; smaller pictures trouble OpenCV."""


@dataclass(frozen=True, eq=False)
class Keypoints:
    """Keypoints (N, 2), x and y in cells of a ``PreparedMap``, and their descriptors."""

    points: NDArray[np.float64]
    descriptors: Descriptors


def detect_orb(picture: NDArray[np.uint8], orb: cv2.ORB) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
    """Detect ORB keypoints: pixels (N, 2) u, v and descriptors (N, 32); none on a blank or very small picture."""
    keypoints, descriptors = orb.detectAndCompute(picture, None) if min(picture.shape) >= SMALLEST_SIDE else ((), None)
    if descriptors is None:
        return np.empty((0, 2)), np.empty((0, 32), np.uint8)
    return np.array([keypoint.pt for keypoint in keypoints], np.float64), descriptors.astype(np.uint8)


def match_descriptors(
    target: Descriptors, source: Descriptors, ratio: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Match descriptors: nearest, and nearer than ``ratio`` times the second nearest.

    Return indices (M,) into the target and (M,) into the source. Source: Lowe 2004, section 7.1.
    """
    if len(target) < 2 or not len(source):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    norm = cv2.NORM_HAMMING if target.dtype == np.uint8 else cv2.NORM_L2
    neighbours = cv2.BFMatcher(norm).knnMatch(source, target, k=2)
    kept = [first for first, second in neighbours if first.distance < ratio * second.distance]
    return np.array([m.trainIdx for m in kept], dtype=np.intp), np.array([m.queryIdx for m in kept], dtype=np.intp)
