"""Relative poses of many pairs of maps, with scores."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mapping.geometry.similarity2_array import Similarity2Array


@dataclass(frozen=True, eq=False)
class RelativePoses:
    """Relative poses of pairs of maps, in arrays (P,).

    ``targets`` and ``sources`` are indices of maps, the lower first; ``target_from_source`` is in metres, at scale 1;
    ``scores`` say how likely they are. The poses of a pair follow one another, the best first.
    """

    targets: NDArray[np.intp]
    sources: NDArray[np.intp]
    target_from_source: Similarity2Array
    scores: NDArray[np.float64]

    @staticmethod
    def none() -> RelativePoses:
        """Return no poses."""
        return RelativePoses(np.zeros(0, np.intp), np.zeros(0, np.intp), Similarity2Array.of(()), np.zeros(0))

    @staticmethod
    def joined(parts: Sequence[RelativePoses]) -> RelativePoses:
        """Join the poses of different pairs."""
        if not parts:
            return RelativePoses.none()
        return RelativePoses(
            np.concatenate([each.targets for each in parts]),
            np.concatenate([each.sources for each in parts]),
            Similarity2Array(
                np.concatenate([each.target_from_source.turn for each in parts]),
                np.concatenate([each.target_from_source.shift for each in parts]),
            ),
            np.concatenate([each.scores for each in parts]),
        )

    def __len__(self) -> int:
        return len(self.scores)

    def __getitem__(self, index: NDArray[np.intp]) -> RelativePoses:
        return RelativePoses(
            self.targets[index], self.sources[index], self.target_from_source[index], self.scores[index]
        )

    def first_of_pairs(self) -> NDArray[np.intp]:
        """Return the index of the best pose of each pair."""
        changes = (np.diff(self.targets) != 0) | (np.diff(self.sources) != 0)
        return np.flatnonzero(np.concatenate(([True], changes))[: len(self)])

    def best_scores(self, maps: int) -> csr_array:
        """Return the score of the best pose of each pair: a sparse symmetric matrix (maps, maps)."""
        first = self.first_of_pairs()
        best = csr_array((self.scores[first], (self.targets[first], self.sources[first])), shape=(maps, maps))
        return csr_array(best + best.T)
