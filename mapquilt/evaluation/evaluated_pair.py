"""One answer to a pair of maps beside its ground truth: the record of every score, benchmark, study and report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.truth import PairTruth
from mapquilt.evaluation.transform_error import (
    RIGHT,
    RIGHT_PLACE,
    Criterion,
    TransformError,
    normalised_error,
    transform_error,
)
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative
from merge.records.result import PairResult

Outcome = Literal["true accept", "false accept", "false reject", "true reject"]

OUTCOMES: tuple[Outcome, ...] = ("false accept", "false reject", "true accept", "true reject")
"""Errors first, the order of tables and pictures."""


@dataclass(frozen=True)
class PairInfo:
    """Identity and origin of a pair of maps; None or empty if unknown.

    - ``name``: unique within ``suite``, the data set or list of pairs; ``subset`` is a part of the suite;
    - ``target``, ``source``: names of the two maps; ``target_file``, ``source_file``: their map files;
    - ``world``, ``noise``: family of worlds and noise level; ``poses``: those that the robots mapped with;
    - ``mission``, ``geometry``: the mission, and a hash of the world that it explores; those of two are joined by a
      plus. Pairs of one world are not independent, and two missions may explore the same;
    - ``level``: values of the settings that a study varies.
    """

    name: str
    target: str
    source: str
    suite: str = ""
    subset: str | None = None
    world: str | None = None
    noise: float | None = None
    poses: str | None = None
    mission: str | None = None
    geometry: str | None = None
    level: tuple[str, ...] = ()
    target_file: Path | None = None
    source_file: Path | None = None

    @property
    def title(self) -> str:
        return f"{self.suite}: {self.name}" if self.suite else self.name

    @property
    def cluster(self) -> str | None:
        """Name the group of dependent pairs: the world of the target, or its mission where no geometry is known."""
        if self.geometry is not None:
            return self.geometry.partition("+")[0]
        return None if self.mission is None else f"{self.suite}/{self.mission.partition('+')[0]}"


@dataclass(frozen=True)
class GroundTruth:
    """True relation of two maps.

    - ``target_from_source``: true transform; None for a pair without common ground, which a merger must refuse;
    - ``overlap``: share of the smaller footprint that both robots observed; None if unknown;
    - ``identifiable``: exactly one placement explains both footprints; False without common ground;
    - ``residual_m``: RMS residual of the fitted true transform [m]: 0 if it is exact, None if nothing was fitted;
    - ``target_scale``: true metres per metre that the target states.
    """

    target_from_source: Similarity2 | None
    overlap: float | None = None
    identifiable: bool = True
    residual_m: float | None = None
    target_scale: float = 1.0

    def __post_init__(self) -> None:
        if self.target_from_source is None:
            object.__setattr__(self, "identifiable", False)

    @staticmethod
    def of(pair: PairTruth, target_scale: float) -> GroundTruth:
        """Read the fitted truth of a pair. Footprints without a common cell have no transform to find."""
        common_ground = pair.footprints.overlap > 0.0
        return GroundTruth(
            target_from_source=pair.target_from_source if common_ground else None,
            overlap=pair.footprints.overlap,
            identifiable=common_ground and pair.footprints.identifiability.identifiable,
            residual_m=pair.residual,
            target_scale=target_scale,
        )


@dataclass(frozen=True)
class EvaluatedPair:
    """One method's answer to a pair of maps beside its truth.

    - ``accepted``: None if the pair was not merged; everything below is then None as well;
    - ``confidence``: 0 to 1; ``reason``: of a refusal, or that an accepted pair was not verified;
    - ``answer``: best transform of the method, accepted or not; ``alternative``: the second-best placement;
    - ``error``: of the answer; None without an answer or without common ground;
    - ``right``: the error is within the criterion, whether the answer was accepted or not;
    - ``distorted``: the residual of the truth exceeds half the displacement that the criterion allows, so that even a
      perfect answer may miss. None exactly if no residual is known; aggregations then treat the pair as distorted,
      because its truth is not known well enough either (``reliable``);
    - ``normalised_error``: see ``transform_error.normalised_error``; None without a covariance;
    - ``seconds``: processor time of the pair on one thread.
    """

    pair: PairInfo
    truth: GroundTruth
    method: str = ""
    accepted: bool | None = None
    confidence: float | None = None
    reason: str | None = None
    answer: Similarity2 | None = None
    evidence: Evidence | None = None
    alternative: Alternative | None = None
    error: TransformError | None = None
    right: bool = False
    distorted: bool | None = None
    normalised_error: float | None = None
    seconds: float | None = None

    @property
    def negative(self) -> bool:
        """True if the maps have no common ground, so that a merger must refuse them."""
        return self.truth.target_from_source is None

    @property
    def identifiable(self) -> bool:
        """True if there is exactly one right answer."""
        return self.truth.identifiable

    @property
    def reliable(self) -> bool:
        """True if the truth is known well enough to judge an answer."""
        return self.negative or self.distorted is False

    @property
    def right_place(self) -> bool:
        """True if the answer lies at the right place, however imprecise."""
        return self.error is not None and RIGHT_PLACE.holds(self.error)

    @property
    def outcome(self) -> Outcome | None:
        """Classify the decision; None if the pair was not merged.

        An accepted answer is a true accept if it is right. A refusal is a false reject if the pair has exactly one
        right answer, a true reject if it has none or several.
        """
        if self.accepted is None:
            return None
        if self.accepted:
            return "true accept" if self.right else "false accept"
        return "false reject" if self.identifiable else "true reject"


def evaluate_pair(
    target: OccupancyGrid,
    source: OccupancyGrid,
    truth: GroundTruth,
    answer: PairResult,
    *,
    pair: PairInfo,
    method: str,
    seconds: float | None = None,
    criterion: Criterion = RIGHT,
) -> EvaluatedPair:
    """Compare an answer with the truth, both target_from_source in metres as the maps state them."""
    true, found = truth.target_from_source, answer.target_from_source
    error, squared = None, None
    if true is not None and found is not None:
        error = transform_error(target, source, true, found, truth.target_scale)
        if answer.covariance is not None:
            squared = normalised_error(true, found, answer.covariance)
    allowed_m = RIGHT.displacement_of_diagonal * target.known_diagonal * truth.target_scale
    return EvaluatedPair(
        pair=pair,
        truth=truth,
        method=method,
        accepted=answer.accepted,
        confidence=answer.confidence,
        reason=answer.remark,
        answer=found,
        evidence=answer.evidence,
        alternative=answer.alternatives[0] if answer.alternatives else None,
        error=error,
        right=error is not None and criterion.holds(error),
        distorted=None if truth.residual_m is None else truth.residual_m > allowed_m / 2.0,
        normalised_error=squared,
        seconds=seconds,
    )
