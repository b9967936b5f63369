"""Take part in a benchmark with the recipe of the ROS package m-explore (map_merge): AKAZE and OpenCV's stitching.

mapquilt benchmark export DATASET --out pairs
python examples/answers_m_explore.py pairs m_explore.csv
mapquilt benchmark --dataset DATASET --method quilt --answers m_explore.csv --out bench
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from answers_opencv import Answer, answer_all

BYTES = {0: 100, 254: 0, 205: 255}
"""Greys of a map file, and the bytes of an OccupancyGrid that map_merge hands to OpenCV: unknown, -1, becomes 255."""

THRESHOLD = 1.0
"""Least confidence of OpenCV, map_merge's ``estimation_confidence``."""


def match(target: np.ndarray, source: np.ndarray) -> Answer:
    """Return the matrix (2, 3) from source to target in pixels, the confidence, and if the pair is accepted."""
    cv2.setRNGSeed(0)
    table = np.array([BYTES.get(grey, 255) for grey in range(256)], np.uint8)
    features = [cv2.detail.computeImageFeatures2(cv2.AKAZE.create(), table[map_]) for map_ in (source, target)]
    if min(len(each.getKeypoints()) for each in features) < 2:
        return None, 0.0, False
    info = cv2.detail.AffineBestOf2NearestMatcher(False, False, 0.3, 6).apply(*features)
    if info.H is None or not np.isfinite(info.H).all():
        return None, 0.0, False
    accepted = info.confidence >= THRESHOLD
    return info.H[:2], info.confidence / (1.0 + info.confidence), bool(accepted)


if __name__ == "__main__":
    answer_all(Path(sys.argv[1]), Path(sys.argv[2]), match)
