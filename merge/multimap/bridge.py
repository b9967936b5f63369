"""An alignment by which two clusters of a large team may join."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from mapping.geometry.similarity2 import Similarity2
from merge.multimap.graph import Cluster, Edge, Pair, placed_together


@dataclass(frozen=True, eq=False)
class Bridge:
    """An alignment of two clusters.

    It places the maps ``between`` on one another, one of either. ``misfit`` is that of all walls that then meet around
    them: the share of the ``length`` [wide cells] compared that is off the walls of the other cluster, divided by the
    share that is usual for these maps. Further away the errors of whole clusters add up. ``pairs`` are the maps that
    meet, those with most in common first.
    """

    first: Cluster
    second: Cluster
    first_from_second: Similarity2
    between: Pair
    misfit: float = math.inf
    length: float = 0.0
    pairs: tuple[Pair, ...] = ()

    @classmethod
    def of_edge(cls, first: Cluster, second: Cluster, edge: Edge) -> Bridge:
        """Align two clusters by one answer, whose target is in the first."""
        place = first.poses[edge.target] @ edge.target_from_source @ second.poses[edge.source].inverse()
        return cls(first, second, place, (edge.target, edge.source))

    @classmethod
    def inside(cls, cluster: Cluster, target: int, source: int) -> Bridge:
        """Align a map with the rest of its cluster, as the cluster has it."""
        rest = Cluster({index: pose for index, pose in cluster.poses.items() if index != source}, ())
        return cls(rest, Cluster.of_one(source), cluster.poses[source], (target, source))

    @property
    def smaller(self) -> Cluster:
        """The cluster of fewer maps; of two of one size that with the larger root."""
        return min(self.first, self.second, key=lambda each: (len(each.poses), -each.root))

    @property
    def larger_first(self) -> Bridge:
        """The same alignment with the larger cluster first."""
        if self.smaller is self.second:
            return self
        return replace(
            self,
            first=self.second,
            second=self.first,
            first_from_second=self.first_from_second.inverse(),
            between=self.between[::-1],
        )

    @property
    def placed(self) -> Cluster:
        """The poses of all maps under the alignment, in the frame of the first cluster, without edges."""
        return placed_together(self.first, self.second, self.first_from_second)

    def target_from_source(self, a: int, b: int) -> Similarity2:
        """Return the relative pose of a map of the first cluster and one of the second."""
        return self.first.poses[a].inverse() @ self.first_from_second @ self.second.poses[b]
