"""What the user may choose about a merge."""

from __future__ import annotations

from dataclasses import dataclass

from merge.methods import PROPOSERS
from merge.scale_range import ScaleRange


@dataclass(frozen=True)
class MergeSettings:
    """``method`` names the proposer; ``scale`` bounds the answers, or is None to let the maps decide.

    Raises ``ValueError`` naming an unknown method.
    """

    method: str = "sift"
    scale: ScaleRange | None = None

    def __post_init__(self) -> None:
        if self.method not in PROPOSERS:
            raise ValueError(f"method is {self.method!r}, must be one of {', '.join(sorted(PROPOSERS))}")
