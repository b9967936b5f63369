"""A transform that a method proposes."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2


@dataclass(frozen=True)
class Proposal:
    """A proposed transform, from cells of the source to cells of the target (``PreparedMap``).

    ``matches`` and ``inliers`` count point pairs and those that agree; None for a method that matches no points.
    ``votes`` counts the proposals that are nearly the same.
    """

    target_from_source: Similarity2
    matches: int | None = None
    inliers: int | None = None
    votes: int = 1
