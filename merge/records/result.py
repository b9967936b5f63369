"""Results of a merge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mapping.arrays import frozen_array
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import Unit
from merge.records.bent_map import BentMap
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative
from merge.records.verdict import Reason, Refusal

DecidedBy = Literal["pair", "team", "prior", "trusted_prior"]
"""A trusted prior stitches a pair without verification."""


@dataclass(frozen=True, eq=False)
class PairResult:
    """The answer for one pair; ``target`` is the map that was given first.

    - ``target_from_source``: from stated metres of the source to stated metres of the target (cells, for a map without
      a resolution; ``unit`` is that of x and y, the target's);
    - ``target_from_source_pixels`` (2, 3): the same between pixels of the images, y down;
    - ``confidence``: probability, 0 to 1, that the answer is right, by its evidence;
    - ``refusal``: reason why the pair was refused; it keeps its best transform;
    - ``decided_by``: whose verdict it is; ``pair_refusal`` is that of the pair alone, if team or prior overruled it.

    The transform is None only if nothing was proposed; the evidence also for a method as published.
    """

    target: str
    source: str
    accepted: bool
    confidence: float
    refusal: Refusal | None
    target_from_source: Similarity2 | None
    target_from_source_pixels: NDArray[np.float64] | None
    unit: Unit
    evidence: Evidence | None
    covariance: NDArray[np.float64] | None = None
    alternatives: tuple[Alternative, ...] = ()
    decided_by: DecidedBy = "pair"
    pair_refusal: Refusal | None = None

    @property
    def reason(self) -> Reason | None:
        """Reason of the refusal, None if the pair is accepted."""
        return None if self.refusal is None else self.refusal.reason

    @property
    def reason_text(self) -> str | None:
        """Reason of the refusal as a text for people."""
        return None if self.refusal is None else str(self.refusal)

    @property
    def verified(self) -> bool:
        """False if the pair was stitched at trusted start poses, whatever its maps show."""
        return self.decided_by != "trusted_prior"

    @property
    def remark(self) -> str | None:
        """Reason of the refusal, or that an accepted pair was not verified; None if there is nothing to say."""
        return self.reason_text if self.verified else "not verified: stitched at the given start poses"

    def __post_init__(self) -> None:
        if self.covariance is not None:
            object.__setattr__(self, "covariance", frozen_array(self.covariance, np.float64))
        if self.target_from_source_pixels is not None:
            pixels = frozen_array(self.target_from_source_pixels, np.float64)
            object.__setattr__(self, "target_from_source_pixels", pixels)


@dataclass(frozen=True, eq=False)
class MergedGroup:
    """A cluster of maps that were merged.

    ``reference_from_map`` holds their transforms, metric as in ``PairResult``, the identity of the reference included.
    ``merged`` is in the frame of the reference; ``conflicts`` has the same cells; ``doubled_walls`` is the share of
    common walls that it shows more than once (``Fused``). ``bends`` are those of the maps that were bent before
    they were fused (``MergeSettings.elastic``), and ``rigid_conflict_cells`` the number of cells in conflict without
    them, None if nobody asked for bends.
    """

    reference: str
    reference_from_map: Mapping[str, Similarity2]
    merged: OccupancyGrid
    conflicts: OccupancyGrid
    doubled_walls: float = 0.0
    bends: Mapping[str, BentMap] = field(default_factory=dict)
    rigid_conflict_cells: int | None = None

    @property
    def conflict_cells(self) -> int:
        """Number of cells in conflict."""
        return int(np.count_nonzero(self.conflicts.occupied))


@dataclass(frozen=True, eq=False)
class MergeResult:
    """The result of a merge.

    ``pairs`` holds one answer per unordered pair. ``groups`` are the clusters of merged maps, each map in one of them;
    that of the reference is first, else the largest. ``reference``, ``reference_from_map`` and ``merged`` are those of
    the first cluster; ``left_out`` gives the reason for every map outside it. ``confidence_calibrated`` is False if the
    confidence only ranks answers and is no probability.
    """

    names: tuple[str, ...]
    pairs: tuple[PairResult, ...]
    groups: tuple[MergedGroup, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)
    confidence_calibrated: bool = False

    @property
    def reference(self) -> str:
        return self.groups[0].reference

    @property
    def reference_from_map(self) -> Mapping[str, Similarity2]:
        return self.groups[0].reference_from_map

    @property
    def merged(self) -> OccupancyGrid:
        return self.groups[0].merged
