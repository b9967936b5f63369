"""Many proposals made few: those that say nearly the same are one, and say how often it was said."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap, smaller_diagonal
from merge.records.proposal import Proposal

SAME_SHARE = 0.035
"""Proposals that put the source's surface this near one another, as a share of the smaller map's diagonal, are one."""


def apart(chart: PreparedMap, transforms: Sequence[Similarity2]) -> NDArray[np.float64]:
    """Root mean square distance (N, N) between the places where transforms put the surface of ``chart``.

    From its mean and variance alone, since the difference of two similarities is linear in the point.
    """
    turns = np.array([t.scale * np.exp(1j * t.yaw) for t in transforms])
    shifts = np.array([t.x + 1j * t.y for t in transforms]) + turns * complex(*chart.middle)
    variance = float(((chart.points - chart.middle) ** 2).sum(axis=1).mean()) if len(chart.points) else 0.0
    squares: NDArray[np.float64] = (
        np.abs(turns[:, None] - turns) ** 2 * variance + np.abs(shifts[:, None] - shifts) ** 2
    )
    return np.sqrt(squares)


def merged(
    target: PreparedMap, source: PreparedMap, proposals: Sequence[Proposal], share: float = SAME_SHARE
) -> list[Proposal]:
    """Proposals, best first, without those that say nearly what one before them says; they become its votes."""
    if not proposals:
        return []
    transforms = [p.target_from_source for p in proposals]
    near = share * np.array([smaller_diagonal(target, source, t.scale) for t in transforms])
    close = apart(source, transforms) < near[:, None]
    free, kept = np.ones(len(proposals), dtype=bool), []
    for k, proposal in enumerate(proposals):
        if free[k]:
            same = close[k] & free
            free &= ~same
            votes = sum(proposals[j].votes for j in np.flatnonzero(same).tolist())
            kept.append(dataclasses.replace(proposal, votes=votes))
    return kept
