"""Settings of the pipeline of one pair."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mapping.validation import require_valid


@dataclass(frozen=True)
class PairSettings:
    """The pipeline of one pair.

    - ``min_wall_points``: maps with fewer are not matched;
    - ``promising_score``: the next proposer is asked first if no quickly refined proposal scores so much;
    - ``sure_score``: no further proposer is asked after an answer that scores so much, with a margin of
      ``AcceptanceSettings.margin_cap``;
    - ``alternatives``: this many other transforms are reported;
    - ``same_log_scale``: an answer whose log scale is nearer to 0 confirms the stated resolutions.
    """

    min_wall_points: int = 20
    promising_score: float = 0.25
    sure_score: float = 0.45
    alternatives: int = 3
    same_log_scale: float = math.log(1.03)

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("alternatives",))
