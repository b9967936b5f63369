"""Deduplication of proposals: those that put the source at nearly the same place become one."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.records.proposal import Proposal


def rms_displacement(source: PreparedMap, transforms: Sequence[Similarity2]) -> NDArray[np.float64]:
    """Measure how far apart transforms put the walls of ``source``: root mean square (N, N), in cells of the target.

    Mean and variance of the wall points suffice, because the difference of two similarities is linear in the point.
    """
    turns = np.array([t.scale * np.exp(1j * t.yaw) for t in transforms])
    shifts = np.array([t.x + 1j * t.y for t in transforms]) + turns * complex(*source.middle)
    variance = float(((source.points - source.middle) ** 2).sum(axis=1).mean()) if len(source.points) else 0.0
    squares: NDArray[np.float64] = (
        np.abs(turns[:, None] - turns) ** 2 * variance + np.abs(shifts[:, None] - shifts) ** 2
    )
    return np.sqrt(squares)


def deduplicate(
    target: PreparedMap, source: PreparedMap, proposals: Sequence[Proposal], share: float
) -> list[Proposal]:
    """Drop proposals that are near one before them, and count them as its votes; the best proposal comes first.

    ``share`` [of the smaller map's diagonal] is how near.
    """
    if not proposals:
        return []
    transforms = [p.target_from_source for p in proposals]
    near = share * np.array([smaller_diagonal(target, source, t.scale) for t in transforms])
    close = rms_displacement(source, transforms) < near[:, None]
    free, kept = np.ones(len(proposals), dtype=bool), []
    for k, proposal in enumerate(proposals):
        if free[k]:
            same = close[k] & free
            free &= ~same
            votes = sum(proposals[j].votes for j in np.flatnonzero(same).tolist())
            kept.append(dataclasses.replace(proposal, votes=votes))
    return kept
