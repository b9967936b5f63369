"""All settings of a merge, as one tree."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from mapping.geometry.scale_range import ScaleRange
from merge.alignment.settings import AlignmentSettings
from merge.fusion import FUSIONS, FusionName, FusionSettings
from merge.literature.chen2021.morphology import Morphology
from merge.literature.chen2021.sift import Sift
from merge.literature.genetic import Genetic
from merge.literature.hough import Hough
from merge.literature.icp import Icp
from merge.literature.kaze_sift import KazeSift
from merge.literature.plain_orb import PlainOrb
from merge.literature.random_walk import RandomWalk
from merge.literature.rectangles import Rectangles
from merge.literature.scaling_icp import ScalingIcp
from merge.literature.stitching import Stitching
from merge.methods import Method, Proposer, Published, method_named, method_names, published_names, register, registered
from merge.multimap.settings import MultimapSettings
from merge.pair.settings import PairSettings
from merge.preparation.settings import PreparationSettings
from merge.proposers.correlation import CorrelationSettings
from merge.proposers.landmarks import Landmarks
from merge.proposers.normal_correlation import NormalCorrelation
from merge.proposers.orb import Orb
from merge.proposers.second_best import SECOND_BEST
from merge.records.prior import Prior, PriorSettings, require_relative
from merge.verification.settings import AcceptanceSettings, UncertaintySettings


@dataclass(frozen=True)
class ProposerSettings:
    """Settings of all proposers: those of ``quilt``, the search for the second best, and the methods of literature.

    The variants ``as_published`` have the values of the publication; the others are tuned for use as proposers.
    """

    orb: Orb = field(default_factory=Orb)
    landmarks: Landmarks = field(default_factory=Landmarks)
    normal_correlation: NormalCorrelation = field(default_factory=NormalCorrelation)
    second_best: CorrelationSettings = SECOND_BEST
    sift: Sift = field(default_factory=Sift)
    sift_as_published: Sift = field(default_factory=Sift.as_published)
    sift_orb: Sift = field(default_factory=lambda: Sift("orb"))
    sift_orb_as_published: Sift = field(default_factory=lambda: Sift.as_published("orb"))
    morphology: Morphology = field(default_factory=Morphology)
    plain_orb: PlainOrb = field(default_factory=PlainOrb)
    stitching: Stitching = field(default_factory=Stitching)
    kaze_sift: KazeSift = field(default_factory=KazeSift)
    scaling_icp: ScalingIcp = field(default_factory=ScalingIcp)
    hough: Hough = field(default_factory=Hough)
    rectangles: Rectangles = field(default_factory=Rectangles)
    random_walk: RandomWalk = field(default_factory=RandomWalk)
    genetic: Genetic = field(default_factory=Genetic)
    icp: Icp = field(default_factory=Icp)


PUBLISHED = " as published"
"""Ending of the title of a method that runs as published."""


@dataclass(frozen=True)
class MergeSettings:
    """Settings of a merge.

    - ``method``: name of a method (``merge.methods``);
    - ``scale``: bounds of the scale [stated metres per stated metre]; None lets the maps decide;
    - ``as_published``: take the method's own answer and acceptance, not the common ones;
    - ``acceptance``: how certain an answer must be;
    - ``reference``: name of the map in whose frame its cluster is expressed; None takes the first given;
    - ``fusion``: rule that combines cells that several maps know; ``merged_grid``: the grid of the result;
    - ``elastic``: bend the maps of a group until their walls fall together, before they are fused; transforms and
      verdicts stay;
    - ``priors``: start poses of maps, as far as they are known; ``trust_priors``: all maps are joined at these, without
      matching or verification;
    - the others: settings of the steps.

    Raises ``ValueError`` for an unknown method or fusion, a method that has no answer of its own, or a prior that says
    nothing.
    """

    method: str = "quilt"
    scale: ScaleRange | None = None
    as_published: bool = False
    acceptance: AcceptanceSettings = field(default_factory=AcceptanceSettings)
    reference: str | None = None
    fusion: FusionName = "log_odds"
    merged_grid: FusionSettings = field(default_factory=FusionSettings)
    elastic: bool = False
    priors: tuple[Prior, ...] = ()
    trust_priors: bool = False
    prior: PriorSettings = field(default_factory=PriorSettings)
    preparation: PreparationSettings = field(default_factory=PreparationSettings)
    proposers: ProposerSettings = field(default_factory=ProposerSettings)
    alignment: AlignmentSettings = field(default_factory=AlignmentSettings)
    uncertainty: UncertaintySettings = field(default_factory=UncertaintySettings)
    pair: PairSettings = field(default_factory=PairSettings)
    multimap: MultimapSettings = field(default_factory=MultimapSettings)

    def __post_init__(self) -> None:
        if self.method not in method_names():
            raise ValueError(f"method is {self.method!r}, must be one of {', '.join(sorted(method_names()))}")
        if self.as_published and self.method not in published_names():
            having = ", ".join(sorted(published_names()))
            raise ValueError(f"method {self.method!r} has no answer of its own as published, only {having} have")
        if self.fusion not in FUSIONS:
            raise ValueError(f"fusion is {self.fusion!r}, must be one of {', '.join(FUSIONS)}")
        if not self.trust_priors:
            require_relative(self.priors, self.reference)

    def __reduce__(self) -> tuple[Callable[..., MergeSettings], tuple[Any, ...]]:
        """Pickle the settings with the method that a user registered, so that worker processes know it."""
        values = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        return _unpickled, (registered(self.method), values)

    @property
    def chosen_proposers(self) -> tuple[Proposer[Any], ...]:
        """Proposers of the method, in order."""
        named = method_named(self.method).proposers
        return tuple(getattr(self.proposers, each) if isinstance(each, str) else each for each in named)

    @property
    def chosen_published(self) -> Published[Any]:
        """Return the method as published. Raises ``ValueError`` if it has no answer of its own."""
        named = method_named(self.method).published
        if named is None:
            raise ValueError(f"method {self.method!r} has no answer of its own as published")
        published: Published[Any] = getattr(self.proposers, named) if isinstance(named, str) else named
        return published

    @property
    def title(self) -> str:
        """Name of the method in records and tables."""
        return f"{self.method}{PUBLISHED}" if self.as_published else self.method


def _unpickled(method: Method | None, values: Mapping[str, Any]) -> MergeSettings:
    if method is not None:
        register(values["method"], method.proposers, method.published)  # type: ignore[arg-type]
    return MergeSettings(**values)
