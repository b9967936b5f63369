"""Straightening: a map whose walls drifted out of parallel bends until they are parallel again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.linalg import spsolve

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity_fit import fit_similarity
from merge.multimap.settings import StraighteningSettings
from merge.preparation.prepared_map import PreparedMap
from merge.records.bend import Bend

Elements = NDArray[np.float64]
"""One value for each element (rows - 1, cols - 1) of a control grid."""


@dataclass(frozen=True, eq=False)
class WallTurns:
    """The turn [rad] that makes the walls of each element parallel or square to the main direction of the map.

    ``weights`` are the shares of the walls that ask for it, in sum 1; ``parallel_share`` is that of the walls that
    need a turn within the bound, each counted by how clearly the walls around it agree modulo 90 degrees.
    """

    turns: Elements
    weights: Elements
    parallel_share: float

    @property
    def median(self) -> float:
        """Median of the turns [rad], without sign."""
        turns, weights = np.abs(self.turns).ravel(), self.weights.ravel()
        order = np.argsort(turns, kind="stable")
        return float(turns[order][np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())])


def straighten(prepared: PreparedMap, settings: StraighteningSettings) -> Bend | None:
    """Bend a map so that its walls are parallel or square to one another; None where that is no matter of drift.

    Drift of the yaw turns parts of a map against one another, and one cannot see from two maps which of them is right.
    Most walls of buildings are parallel or square (the Manhattan world of Coughlan and Yuille 1999), and that shows the
    drift of each map by itself. The bend minimises the mean squared difference of its local turn and that which the
    walls ask for, plus the mean squared strain. It keeps the mean place and direction of the walls. A map of which too
    few walls are nearly square, as of a cave, stays, and so does one whose walls are square already.
    """
    if len(prepared.points) < settings.min_points:
        return None
    rest = Bend.at_rest(prepared.points, settings.node_share * prepared.diagonal)
    asked = wall_turns(prepared, rest, settings)
    if asked.parallel_share < settings.min_parallel_share or asked.median < math.radians(settings.min_turn_deg):
        return None
    bend = rest.displaced(_solved(asked, rest, settings.stiffness))
    whole = fit_similarity(bend.apply(prepared.points), prepared.points, ScaleRange.known())
    return bend.relative_to(whole or Similarity2.identity())


def wall_turns(prepared: PreparedMap, rest: Bend, settings: StraighteningSettings) -> WallTurns:
    """Measure which turn the walls of each element ask for.

    Angles count modulo 90 degrees, so as the angle of the mean of exp(4 i angle), over the neighbours too.
    """
    seen = prepared.normals.any(axis=1)
    points, normals = prepared.points[seen], prepared.normals[seen]
    rows, cols = (side - 1 for side in rest.nodes.shape[:2])
    col, row = np.floor((points - rest.corner) / rest.spacing).astype(np.int64).clip(0, (cols - 1, rows - 1)).T
    element = row * cols + col
    square = (normals[:, 0] + 1j * normals[:, 1]) ** 4
    main = complex(square.sum())
    square *= main.conjugate() / abs(main) if main else 1.0
    real, imaginary, count = (
        np.bincount(element, values, rows * cols).reshape(rows, cols)
        for values in (square.real, square.imag, np.ones(len(points)))
    )
    x, y, number = (
        cv2.GaussianBlur(each, (0, 0), settings.blur_elements, borderType=cv2.BORDER_CONSTANT)
        for each in (real, imaginary, count)
    )
    turns = -np.arctan2(y, x) / 4.0
    within = np.abs(turns) < math.radians(settings.max_turn_deg)
    clear = np.hypot(x, y) / np.maximum(number, 1e-9)
    weights = count * clear * within
    share = float(weights.sum()) / max(1e-9, float(count.sum()))
    return WallTurns(np.where(within, turns, 0.0), weights / max(1e-9, float(weights.sum())), share)


def _solved(asked: WallTurns, rest: Bend, stiffness: float) -> NDArray[np.float64]:
    """Solve for the nodes (rows, cols, 2): linear least squares of turns and strains, a dozen terms an element."""
    rows, cols, _ = rest.nodes.shape
    node = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = (each.ravel() for each in (node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:]))
    half = 0.5 / rest.spacing
    x_changes = [(b, half), (a, -half), (d, half), (c, -half)]
    y_changes = [(c, half), (a, -half), (d, half), (b, -half)]
    turn = [(2 * n + 1, 0.5 * f) for n, f in x_changes] + [(2 * n, -0.5 * f) for n, f in y_changes]
    shear = [(2 * n + 1, 0.5 * f) for n, f in x_changes] + [(2 * n, 0.5 * f) for n, f in y_changes]
    each = stiffness / len(a)
    blocks = [(turn, asked.weights.ravel(), asked.turns.ravel()), (shear, np.full(len(a), 2.0 * each), None)]
    for ends, axis in (((a, b), 0), ((c, d), 0), ((a, c), 1), ((b, d), 1)):
        stretch = [(2 * ends[1] + axis, 2.0 * half), (2 * ends[0] + axis, -2.0 * half)]
        blocks.append((stretch, np.full(len(a), each / 2.0), None))
    still = [(np.arange(2 * rows * cols), 1.0)]
    blocks.append((still, np.full(2 * rows * cols, 1e-9 / rest.spacing**2), None))  # a rigid motion is free
    size = 2 * rows * cols
    matrix, right = csr_array((size, size)), np.zeros(size)
    for terms, weights, values in blocks:
        lines = np.arange(len(weights))
        equations = csr_array(
            (
                np.concatenate([np.full(len(lines), factor) for _, factor in terms]),
                (np.tile(lines, len(terms)), np.concatenate([unknown for unknown, _ in terms])),
            ),
            shape=(len(lines), size),
        )
        weighted = equations.T @ csr_array((weights, (lines, lines)), shape=(len(lines), len(lines)))
        matrix = matrix + weighted @ equations
        if values is not None:
            right += weighted @ values
    return np.asarray(spsolve(matrix.tocsc(), right)).reshape(rows, cols, 2)
