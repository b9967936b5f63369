"""What every method of proposing transforms looks like from outside."""

from __future__ import annotations

from typing import Protocol, TypeVar

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal

Description = TypeVar("Description")


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
