"""The answer for a pair, in cells of the prepared maps."""

from __future__ import annotations

from dataclasses import dataclass

from mapping.geometry.similarity2 import Similarity2
from merge.records.result import Evidence
from merge.records.uncertainty import Uncertainty
from merge.records.verdict import Verdict


@dataclass(frozen=True)
class Alternative:
    """Another place for the source, cells to cells, and how well the walls agree there (``Evidence``)."""

    target_from_source: Similarity2
    score: float


@dataclass(frozen=True)
class PairAnswer:
    """The best candidate, cells to cells, with its evidence, and the decision. None where nothing was proposed, the
    uncertainty also where a method answered as published. ``alternatives`` lie elsewhere, the best of them first."""

    target_from_source: Similarity2 | None
    evidence: Evidence | None
    verdict: Verdict
    uncertainty: Uncertainty | None = None
    alternatives: tuple[Alternative, ...] = ()

    @property
    def score(self) -> float:
        return 0.0 if self.evidence is None else self.evidence.score

    def inverse(self) -> PairAnswer:
        """The answer for the pair the other way round."""
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
