"""What the user may choose about a merge."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.geometry.scale_range import ScaleRange
from merge.fusion import FUSIONS, FusionName
from merge.methods import PROPOSERS, PUBLISHED
from merge.multimap.settings import MultimapSettings
from merge.records.prior import Prior, expected_places
from merge.verification.acceptance import AcceptanceSettings


@dataclass(frozen=True)
class MergeSettings:
    """``method`` names the proposer; ``scale`` bounds the answers, or is None to let the maps decide; ``as_published``
    takes the method's own answer and its own rule of acceptance in place of the common judge; ``decision`` is how sure
    that judge must be. ``reference`` names the map in whose frame its group is told, or is None for the largest;
    ``fusion`` says how cells that several maps know are joined; ``priors`` where maps are roughly known to lie.

    Raises ``ValueError`` naming an unknown method or fusion, a method that has no answer of its own, or a prior that
    says nothing.
    """

    method: str = "quilt"
    scale: ScaleRange | None = None
    as_published: bool = False
    acceptance: AcceptanceSettings = field(default_factory=AcceptanceSettings)
    reference: str | None = None
    fusion: FusionName = "log_odds"
    priors: tuple[Prior, ...] = ()
    multimap: MultimapSettings = field(default_factory=MultimapSettings)

    def __post_init__(self) -> None:
        if self.method not in PROPOSERS:
            raise ValueError(f"method is {self.method!r}, must be one of {', '.join(sorted(PROPOSERS))}")
        if self.as_published and self.method not in PUBLISHED:
            having = ", ".join(sorted(PUBLISHED))
            raise ValueError(f"method {self.method!r} has no answer of its own as published, only {having} have")
        if self.fusion not in FUSIONS:
            raise ValueError(f"fusion is {self.fusion!r}, must be one of {', '.join(FUSIONS)}")
        expected_places(self.priors, self.reference)

    @property
    def title(self) -> str:
        """What records and tables call the method."""
        return f"{self.method} as published" if self.as_published else self.method
