"""Take part in a benchmark with MRPT's grid-map aligner (Blanco et al. 2013), a program in C++: rigid, equal cells.

apt install libmrpt-slam-dev
g++ -O2 -std=c++17 examples/answers_mrpt.cpp -o answers_mrpt -I/usr/include/eigen3 \
    $(printf -- '-I%s ' /usr/include/mrpt/*/include) \
    $(printf -- '-lmrpt-%s ' slam maps obs poses tfest vision math img rtti serialization system containers core bayes)
mapquilt benchmark export DATASET --out pairs
python examples/answers_mrpt.py pairs mrpt.csv ./answers_mrpt
mapquilt benchmark --dataset DATASET --method quilt --answers mrpt.csv --out bench
"""

import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from answers_opencv import Answer, answer_all

CELL = 0.05
"""Resolution [m] that both maps are taken to have: the aligner knows no scale."""


def match(target: np.ndarray, source: np.ndarray, program: str) -> Answer:
    """Return the matrix (2, 3) from source to target in pixels, the confidence, and if the pair is accepted."""
    with tempfile.TemporaryDirectory() as folder:
        files = [f"{folder}/{name}.png" for name in ("target", "source")]
        for file, picture in zip(files, (target, source), strict=True):
            cv2.imwrite(file, picture)
        printed = subprocess.run([program, *files, str(CELL)], capture_output=True, text=True).stdout.split()
    if len(printed) != 4:
        return None, 0.0, False
    x, y, yaw, goodness = map(float, printed)
    return pixel_matrix(x, y, yaw, target.shape[0], source.shape[0]), min(1.0, max(0.0, goodness)), True


def pixel_matrix(x: float, y: float, yaw: float, target_rows: int, source_rows: int) -> np.ndarray:
    """Convert a pose [m, rad] between lower left corners, y up, to a matrix of pixels, centres at integers, y down."""
    c, s, top, bottom = np.cos(yaw), np.sin(yaw), target_rows - 0.5, source_rows - 0.5
    across = 0.5 * c - s * bottom + x / CELL - 0.5
    return np.array([[c, s, across], [-s, c, top - 0.5 * s - c * bottom - y / CELL]])


if __name__ == "__main__":
    answer_all(Path(sys.argv[1]), Path(sys.argv[2]), partial(match, program=str(Path(sys.argv[3]).resolve())))
