"""Settings of the alignment of two maps."""

from __future__ import annotations

from dataclasses import dataclass, field

from mapping.validation import require_valid
from merge.verification.settings import WallOverlapSettings


@dataclass(frozen=True)
class IcpSettings:
    """A Gauss-Newton step of the iterative closest points.

    - ``line_weight``: weight of the distance along the normal; the rest is that of the plain distance, which holds ends
      and corners of walls;
    - ``damping``: share of the trace that is added to the diagonal, so that the equations can always be solved;
    - ``max_log_scale_step``: change of the log scale in one step, at most.
    """

    line_weight: float = 0.8
    damping: float = 1e-12
    max_log_scale_step: float = 0.1

    def __post_init__(self) -> None:
        require_valid(self, shares=("line_weight",))


@dataclass(frozen=True)
class CoarseToFineSettings:
    """Refinement of one transform with a gate that narrows: the largest distance of two points that are paired.

    - ``first_gate_share`` [of the smaller map's diagonal], ``last_gate_cells`` [cells of the coarser map]: the first
      and the last gate;
    - ``shrink``: factor from one gate to the next;
    - ``last_steps``: steps at the last gate;
    - ``max_points``: wall points of either map;
    - ``search_rounds``: rounds of the pattern search;
    - ``min_gain``: two scores that differ by less are equal; thinning and rounding make such differences.
    """

    first_gate_share: float = 0.05
    last_gate_cells: float = 2.0
    shrink: float = 0.8
    last_steps: int = 6
    max_points: int = 2000
    search_rounds: int = 6
    min_gain: float = 0.005

    def __post_init__(self) -> None:
        require_valid(self)
        if self.shrink >= 1.0:
            raise ValueError(f"CoarseToFineSettings: shrink is {self.shrink}, must be less than 1")


@dataclass(frozen=True)
class PatchwiseSettings:
    """Alignment of distorted maps, patch by patch; shares are of the smaller map's diagonal.

    - ``patch_share``: side of a patch; drift bends so little nearly rigidly;
    - ``gate_shares``: gates of the steps that align a patch;
    - ``stiffness``: weight of the whole map's transform against the walls of the patch;
    - ``min_points``: smaller patches are left out;
    - ``rounds``: of aligning all patches and fitting one transform to them.
    """

    patch_share: float = 0.15
    gate_shares: tuple[float, ...] = (0.05, 0.04, 0.03, 0.025, 0.02, 0.015, 0.015)
    stiffness: float = 0.1
    min_points: int = 12
    rounds: int = 2

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("stiffness",))


@dataclass(frozen=True)
class ContradictionSettings:
    """When walls in the free space of the other map are a conflict.

    ``min_piece_tolerances`` [of the loosest tolerance]: their connected pieces extend at least so far, 7 % of the
    smaller map's diagonal. Shorter ones are trees and furniture that one robot saw and the other did not.
    """

    min_piece_tolerances: float = 5.0

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class HypothesisSettings:
    """The way from proposals to a few refined hypotheses; shares are of the smaller map's diagonal.

    - ``same_share``: proposals whose walls are so near one another (root mean square) are one;
    - ``distinct_share``: hypotheses that are further apart compete with one another;
    - ``first_gate_share``, ``last_gate_share``, ``gates``: the gates, in geometric sequence, of the first few steps
      that move every proposal to the walls nearby; proposals are so far off;
    - ``coarse_points``: wall points of those steps;
    - ``ranking_points``: wall points on which the proposals are then ranked;
    - ``final_points``: wall points on which refined hypotheses are measured;
    - ``refined``: proposals that are refined quickly; ``refined_second_best``: those that compete with an answer;
    - ``finalists``: hypotheses that are then refined with care; ``second_best_finalists``: those that compete;
    - ``crisp_ratio``: if this share of the compared walls matches, neither pattern search nor patches can improve;
    - ``hopeless_gap``: a hypothesis that scores so much less than the best is no competitor, and is not searched on;
    - ``min_tolerance_score``: the maps meet a tolerance if some hypothesis scores by it this share of the best score by
      the loosest one;
    - ``min_patch_shift_share``: the transform of the patches replaces the best one if it moves the walls by at least
      this; less is no distortion;
    - ``max_patch_loss``: and if it scores at most so much less.
    """

    same_share: float = 0.035
    distinct_share: float = 0.06
    first_gate_share: float = 0.08
    last_gate_share: float = 0.012
    gates: int = 8
    coarse_points: int = 200
    ranking_points: int = 400
    final_points: int = 4000
    refined: int = 16
    refined_second_best: int = 8
    finalists: int = 4
    second_best_finalists: int = 3
    crisp_ratio: float = 0.98
    hopeless_gap: float = 0.35
    min_tolerance_score: float = 0.85
    min_patch_shift_share: float = 0.004
    max_patch_loss: float = 0.05

    def __post_init__(self) -> None:
        require_valid(
            self,
            not_negative=("min_patch_shift_share", "max_patch_loss"),
            shares=("crisp_ratio", "min_tolerance_score"),
        )


@dataclass(frozen=True)
class AlignmentSettings:
    """Settings of the alignment, by step. ``quick`` refines many proposals, ``careful`` the best of them."""

    overlap: WallOverlapSettings = field(default_factory=WallOverlapSettings)
    icp: IcpSettings = field(default_factory=IcpSettings)
    quick: CoarseToFineSettings = field(default_factory=lambda: CoarseToFineSettings(max_points=500, last_steps=3))
    careful: CoarseToFineSettings = field(default_factory=CoarseToFineSettings)
    patchwise: PatchwiseSettings = field(default_factory=PatchwiseSettings)
    contradiction: ContradictionSettings = field(default_factory=ContradictionSettings)
    hypotheses: HypothesisSettings = field(default_factory=HypothesisSettings)
