"""Transforms between maps in pixels of their images."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame


def pixel_matrix(target: GridFrame, target_from_source: Similarity2, source: GridFrame) -> NDArray[np.float64]:
    """Return the (2, 3) matrix from pixels of the source's image to pixels of the target's.

    It is ``P_target^-1 S P_source``, what ``cv2.warpAffine`` takes as forward matrix; its angle has the opposite
    sign of ``target_from_source.yaw``, because y points down in images.
    """
    similarity = np.vstack((target_from_source.matrix(), (0.0, 0.0, 1.0)))
    metre_from_pixel = similarity @ source.metre_from_pixel()
    return np.linalg.solve(target.metre_from_pixel(), metre_from_pixel)[:2].astype(np.float64)


def similarity_from_pixels(target: GridFrame, matrix: ArrayLike, source: GridFrame) -> Similarity2:
    """Invert ``pixel_matrix``: return the metric ``target_from_source`` of a (2, 3) pixel matrix."""
    pixels = np.vstack((np.asarray(matrix, dtype=np.float64), (0.0, 0.0, 1.0)))
    metric = target.metre_from_pixel() @ pixels @ np.linalg.inv(source.metre_from_pixel())
    return Similarity2.from_matrix(metric[:2])
