"""The answer for a pair, in cells of the prepared maps."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from merge.records.evidence import Evidence
from merge.records.uncertainty import Uncertainty
from merge.records.verdict import Verdict


@dataclass(frozen=True)
class Alternative:
    """Another transform, cells to cells, and its score."""

    target_from_source: Similarity2
    score: float


@dataclass(frozen=True)
class PairAnswer:
    """The best hypothesis, cells to cells, with its evidence and the verdict.

    Transform and evidence are None if nothing was proposed, evidence and uncertainty also for a method as published.
    ``alternatives`` are the transforms elsewhere, best first.
    """

    target_from_source: Similarity2 | None
    evidence: Evidence | None
    verdict: Verdict
    uncertainty: Uncertainty | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def score(self) -> float:
        return 0.0 if self.evidence is None else self.evidence.score

    def inverse(self) -> PairAnswer:
        """Return the answer with target and source swapped."""
        answer = self.target_from_source
        if answer is None:
            return self
        return PairAnswer(
            answer.inverse(),
            self.evidence,
            self.verdict,
            None if self.uncertainty is None else self.uncertainty.inverse(answer),
            tuple(Alternative(other.target_from_source.inverse(), other.score) for other in self.alternatives),
        )
