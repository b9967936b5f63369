"""Least-squares fit of a similarity to point pairs."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2


def fit_similarity(target: NDArray[np.float64], source: NDArray[np.float64], scale: ScaleRange) -> Similarity2 | None:
    """Fit ``target_from_source`` to points (N, 2) and (N, 2) by least squares, its scale within bounds.

    Source: Umeyama 1991, equations 40 to 42, written with complex numbers: in the plane the rotation U S V^T and
    tr(D S) are angle and length of one complex covariance. The rotation does not depend on the scale, and the error is
    a parabola in it, so the bounded optimum is the nearest bound. Returns None if the source points coincide, or if the
    covariance vanishes and every rotation fits equally.
    """
    if len(source) < 2:
        return None
    p, q = source[:, 0] + 1j * source[:, 1], target[:, 0] + 1j * target[:, 1]
    p_mean, q_mean = p.mean(), q.mean()
    p, q = p - p_mean, q - q_mean
    variance = float((p * p.conj()).real.sum())
    covariance = complex((q * p.conj()).sum())
    if variance == 0.0 or covariance == 0.0:
        return None
    yaw = math.atan2(covariance.imag, covariance.real)  # equation 40
    size = scale.clip(abs(covariance) / variance)  # equation 42
    shift = q_mean - size * complex(math.cos(yaw), math.sin(yaw)) * p_mean  # equation 41
    return Similarity2(float(shift.real), float(shift.imag), yaw, size)
