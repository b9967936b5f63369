"""Take part in a benchmark with 30 lines of OpenCV: ORB features, a ratio test, RANSAC.

mapquilt benchmark export DATASET --out pairs
python examples/answers_opencv.py pairs opencv.csv
mapquilt benchmark --dataset DATASET --method quilt --answers opencv.csv --out bench
"""

import csv
import json
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

COLUMNS = ("pair", "scale", "rotation_deg", "tx", "ty", "confidence", "accepted", "seconds")
Answer = tuple[np.ndarray | None, float, bool]


def match(target: np.ndarray, source: np.ndarray) -> Answer:
    """Return the matrix (2, 3) from source to target in pixels, the confidence, and if the pair is accepted."""
    orb, matcher = cv2.ORB.create(2000), cv2.BFMatcher(cv2.NORM_HAMMING)
    (there, wanted), (here, found) = (orb.detectAndCompute(picture, None) for picture in (target, source))
    if wanted is None or found is None:
        return None, 0.0, False
    pairs = [two for two in matcher.knnMatch(found, wanted, k=2) if len(two) == 2]
    good = [best for best, second in pairs if best.distance < 0.8 * second.distance]
    if len(good) < 3:
        return None, 0.0, False
    source_points = np.array([here[one.queryIdx].pt for one in good])
    target_points = np.array([there[one.trainIdx].pt for one in good])
    matrix, inliers = cv2.estimateAffinePartial2D(source_points, target_points, ransacReprojThreshold=3.0)
    count = 0 if matrix is None else int(inliers.sum())
    return matrix, count / (count + 15.0), count >= 15


def answer_all(export: Path, out: Path, match: Callable[[np.ndarray, np.ndarray], Answer]) -> None:
    """Answer every pair of an export, and write the CSV file that ``mapquilt benchmark --answers`` scores."""
    with out.open("w", newline="") as file:
        rows = csv.DictWriter(file, COLUMNS)
        rows.writeheader()
        for pair in json.loads((export / "export.json").read_text())["pairs"]:
            pictures = [
                cv2.imread(str(export / pair[side]).replace(".yaml", ".png"), 0) for side in ("target", "source")
            ]
            start = sum(os.times()[:4])  # processor time, that of child processes included
            matrix, confidence, accepted = match(*pictures)
            row = {"pair": pair["pair"], "confidence": 0.0, "accepted": 0, "seconds": sum(os.times()[:4]) - start}
            if matrix is not None and math.hypot(*matrix[:, 0]) > 1e-6:  # RANSAC may shrink a picture to a point
                (a, _, x), (b, _, y) = matrix
                row |= {"scale": math.hypot(a, b), "rotation_deg": math.degrees(math.atan2(b, a)), "tx": x, "ty": y}
                row |= {"confidence": confidence, "accepted": int(accepted)}
            rows.writerow(row)


if __name__ == "__main__":
    answer_all(Path(sys.argv[1]), Path(sys.argv[2]), match)
