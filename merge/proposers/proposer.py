"""Interface of all methods that propose transforms."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal

Description = TypeVar("Description")


class Proposer(Protocol[Description]):
    """A method that describes each map once, then proposes transforms for each pair.

    Proposals may be of any number, order and quality: alignment, verification and acceptance are common to all methods.
    """

    def describe(self, prepared: PreparedMap) -> Description:
        """Compute all that the method needs of one map; called once for all pairs of the map."""
        ...

    def propose(
        self, target: Description, source: Description, scale: ScaleRange, rng: np.random.Generator
    ) -> tuple[Proposal, ...]:
        """Propose transforms, best first, with scales [cells per cell] in the range; empty if there are none."""
        ...
