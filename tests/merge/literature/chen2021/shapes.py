"""Shapes with known results, as pictures of white walls."""

from __future__ import annotations

import math

import cv2
import numpy as np

SIDE = 300
POLYGON = np.array([(-95, -80), (95, -80), (95, 10), (20, 10), (20, 70), (-95, 70)], np.float64)
"""Corners of an L-shaped room about the picture's middle, u right and v down."""


def turned(points, angle, side=SIDE):
    """Turned by ``angle`` from u to v, about the picture's middle."""
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + side / 2


def outline(points, thickness=2, side=SIDE):
    image = np.zeros((side, side), np.uint8)
    cv2.polylines(image, [np.round(points * 16).astype(np.int32)], True, 255, thickness, cv2.LINE_8, 4)
    return image


def filled(points):
    image = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillPoly(image, [np.round(points * 16).astype(np.int32)], 255, cv2.LINE_8, 4)
    return image


def rectangle(width, height):
    half = np.array([width, height]) / 2
    return np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half
