"""All poses at once from what the pairs say: motion averaging by a library's sparse least squares."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mapping.similarity2 import Similarity2
from merge.edge import Edge, difference

Poses = Mapping[int, Similarity2]
"""Where maps lie: root_from_map between local frames."""


def averaged(poses: Poses, edges: Sequence[Edge], root: int, fixed_scale: bool) -> dict[int, Similarity2]:
    """The poses that agree best with all edges, whitened by their covariances; the root stays where it is.

    Source: least squares on a graph of poses (Lu and Milios 1997; for grid maps, Jiang et al. 2019), solved by
    SciPy's trust region with a sparse Jacobian.
    """
    from scipy.optimize import least_squares  # only teams need it

    free = [index for index in sorted(poses) if index != root]
    if len(edges) < len(poses):  # a tree is as its edges have it
        return dict(poses)
    unknowns = 3 if fixed_scale else 4
    whitening = [whitener(edge.covariance[:unknowns, :unknowns]) for edge in edges]
    column = {index: unknowns * k for k, index in enumerate(free)}

    def residuals(values: NDArray[np.float64]) -> NDArray[np.float64]:
        placed = unpacked(values, poses, free, unknowns)
        return np.concatenate(
            [
                white @ difference(placed[e.target].inverse() @ placed[e.source], e.target_from_source)[:unknowns]
                for white, e in zip(whitening, edges, strict=True)
            ]
        )

    def jacobian(values: NDArray[np.float64]) -> csr_array:
        placed = unpacked(values, poses, free, unknowns)
        blocks = [whitened @ both for whitened, both in zip(whitening, _slopes(placed, edges, unknowns), strict=True)]
        return assembled(blocks, edges, column, unknowns)

    start = packed(poses, free, unknowns)
    found = least_squares(residuals, start, jacobian, x_scale="jac", tr_solver="lsmr", max_nfev=30)
    return unpacked(found.x, poses, free, unknowns)


def whitener(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix that makes a residual of that covariance one of unit covariance."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def packed(poses: Poses, free: Sequence[int], unknowns: int) -> NDArray[np.float64]:
    """x, y, yaw (and log scale) of the free maps, one after the other."""
    rows = [(p.x, p.y, p.yaw, math.log(p.scale))[:unknowns] for p in (poses[index] for index in free)]
    return np.array(rows).ravel()


def unpacked(values: NDArray[np.float64], poses: Poses, free: Sequence[int], unknowns: int) -> dict[int, Similarity2]:
    """The inverse of :func:`packed`; what is not free, and scales that are fixed, are those of ``poses``."""
    placed = dict(poses)
    for index, row in zip(free, values.reshape(-1, unknowns).tolist(), strict=True):
        scale = math.exp(row[3]) if unknowns == 4 else poses[index].scale
        placed[index] = Similarity2(row[0], row[1], row[2], scale)
    return placed


def assembled(
    blocks: Sequence[NDArray[np.float64]], edges: Sequence[Edge], column: Mapping[int, int], unknowns: int
) -> csr_array:
    """The sparse Jacobian of edges in turn, whose blocks (rows, 2 unknowns) belong to the target and to the source."""
    data, rows, cols = [], [], []
    row = 0
    for block, edge in zip(blocks, edges, strict=True):
        for k, index in enumerate((edge.target, edge.source)):
            if index in column:
                part = block[:, k * unknowns : (k + 1) * unknowns]
                data.append(part.ravel())
                rows.append(np.repeat(np.arange(row, row + len(part)), unknowns))
                cols.append(np.tile(np.arange(column[index], column[index] + unknowns), len(part)))
        row += len(block)
    shape = (row, unknowns * len(column))
    return csr_array((np.concatenate(data), (np.concatenate(rows), np.concatenate(cols))), shape=shape)


def _slopes(placed: Poses, edges: Sequence[Edge], unknowns: int) -> list[NDArray[np.float64]]:
    return [slope(placed[edge.target], placed[edge.source])[:unknowns][:, _kept(unknowns)] for edge in edges]


def _kept(unknowns: int) -> list[int]:
    return [k for k in range(8) if k % 4 < unknowns]


def slope(target: Similarity2, source: Similarity2) -> NDArray[np.float64]:
    """d (x, y, yaw, log scale) of target^-1 source by those of the target and of the source: (4, 8)."""
    c, s = math.cos(target.yaw) / target.scale, math.sin(target.yaw) / target.scale
    back = np.array([[c, s], [-s, c]])
    between = back @ np.array([source.x - target.x, source.y - target.y])
    out = np.zeros((4, 8))
    out[:2, :2], out[:2, 4:6] = -back, back
    out[:2, 2] = between[1], -between[0]  # turning the target turns what lies between the other way
    out[:2, 3] = -between
    out[2, 2], out[2, 6] = -1.0, 1.0
    out[3, 3], out[3, 7] = -1.0, 1.0
    return out
