"""What every method of proposing transforms looks like from outside."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.preparation.prepared_map import PreparedMap

Description = TypeVar("Description")


@dataclass(frozen=True)
class Proposal:
    """A transform worth judging, from cells of the source to cells of the target (``PreparedMap``).

    ``matches`` and ``inliers`` count point pairs and those that agree; None for a method that matches no points.
    ``votes`` is how many proposals said nearly the same.
    """

    target_from_source: Similarity2
    matches: int | None = None
    inliers: int | None = None
    votes: int = 1


class Proposer(Protocol[Description]):
    """A method: it looks at each map once, then proposes for each pair.

    Its proposals may come in any number, order and quality: verification, refinement and decision are common to all
    methods and lie outside.
    """

    def describe(self, chart: PreparedMap) -> Description:
        """What the method needs to know of one map; done once however many pairs the map is in."""
        ...

    def propose(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Transforms worth judging, best first, with scales [cells per cell] in the range; empty if there are none."""
        ...
