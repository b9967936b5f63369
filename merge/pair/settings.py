"""Settings of the pipeline of one pair."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.validation import require_valid


@dataclass(frozen=True)
class SymmetrySettings:
    """When a place counts as looking the same turned by 180 degrees. Chosen on generated pairs of 13 families.

    - ``peaks``: half turns of each map that are refined;
    - ``min_self_share``, ``min_self_ratio``: after a half turn of a map this share of its walls lies on its walls, and
      this share of those that are compared; others are no candidates;
    - ``min_rough_ratio``: the latter, before the refinement;
    - ``min_share``: length of the walls that lie on each other when either map is turned onto either, as a share of
      all walls of both. A piece of corridor looks the same turned in any building;
    - ``min_normal_isotropy``: the walls that lie on each other run in more than one direction, for the same reason; 0.2
      is one metre across for four along;
    - ``max_ratio_loss``: of the compared walls at most so much less match than at the answer;
    - ``max_more_violation``: with drift compensated, at most so much more of them contradict than at the answer;
    - ``max_violation``: and at most so much of them at all, at the answer too.
    """

    peaks: int = 12
    min_self_share: float = 0.1
    min_self_ratio: float = 0.85
    min_rough_ratio: float = 0.8
    min_share: float = 0.35
    min_normal_isotropy: float = 0.2
    max_ratio_loss: float = 0.07
    max_more_violation: float = 0.05
    max_violation: float = 0.08

    def __post_init__(self) -> None:
        ratios = "min_self_share", "min_self_ratio", "min_rough_ratio", "min_normal_isotropy"
        require_valid(self, shares=(*ratios, "max_ratio_loss", "max_more_violation", "max_violation"))


@dataclass(frozen=True)
class PairSettings:
    """The pipeline of one pair.

    - ``min_wall_points``: maps with fewer are not matched;
    - ``promising_score``: the next proposer is asked first if no quickly refined proposal scores so much;
    - ``competing_score``: rivals of an answer are sought only if its walls, not bent, score so much by the loosest
      tolerance; less is refused anyway;
    - ``sure_score``: no further proposer is asked after an answer that scores so much, with a margin of
      ``AcceptanceSettings.margin_cap``;
    - ``alternatives``: this many other transforms are reported;
    - ``same_log_scale``: an answer whose log scale is nearer to 0 confirms the stated resolutions;
    - ``symmetry``: when a symmetry of the place makes two placements alike;
    - ``explains_refusals``: refused maps are matched at other scales and mirrored, too, to name such a reason.
    """

    min_wall_points: int = 20
    promising_score: float = 0.25
    competing_score: float = 0.4
    sure_score: float = 0.45
    alternatives: int = 3
    same_log_scale: float = math.log(1.03)
    symmetry: SymmetrySettings = field(default_factory=SymmetrySettings)
    explains_refusals: bool = True

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("alternatives",))
