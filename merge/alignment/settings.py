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
class ElasticSettings:
    """Elastic alignment: a smooth bend of one map onto the other. Shares are of the smaller map's diagonal.

    - ``node_share``: distance of the nodes of the control grid;
    - ``gate_shares``: largest distance of two walls that are paired, for each step;
    - ``stiffness`` [squared diagonals]: weight of the mean squared strain against the mean squared distance of the
      walls; a strain of 4 % costs as much as a distance of 0.1 % of the diagonal;
    - ``curvature`` [squared diagonals]: weight of the mean squared change of strain from node to node;
    - ``strain_cost``: the score of a bent hypothesis falls by so much times its strain;
    - ``line_weight``: as in ``IcpSettings``;
    - ``max_points``: wall points of either map;
    - ``matched_share``, ``min_matched_cells`` [cells of the coarser map]: bent walls so near to one of the target count
      for the transform, at least ``min_points`` of them.
    """

    node_share: float = 0.1
    gate_shares: tuple[float, ...] = (0.05, 0.04, 0.03, 0.025, 0.02, 0.015, 0.012, 0.01, 0.01)
    stiffness: float = 0.0005
    curvature: float = 0.0005
    strain_cost: float = 0.5
    line_weight: float = 0.8
    max_points: int = 2000
    matched_share: float = 0.007
    min_matched_cells: float = 1.5
    min_points: int = 20

    def __post_init__(self) -> None:
        require_valid(self, shares=("line_weight",))


@dataclass(frozen=True)
class ContradictionSettings:
    """When walls in the free space of the other map contradict.

    - ``level``: index of the tolerance by which they are counted, 0.7 % of the smaller map's diagonal;
    - ``min_piece_tolerances`` [of the loosest tolerance]: they are a conflict if their connected pieces extend so far,
      7 % of the diagonal. Shorter ones are trees and furniture that one robot saw and the other did not.
    """

    level: int = 2
    min_piece_tolerances: float = 5.0

    def __post_init__(self) -> None:
        require_valid(self, not_negative=("level",))


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
    - ``bent``: hypotheses, the best ones, that are bent and compared by how well their walls then fit;
    - ``min_tolerance_score``: a bent hypothesis meets a tolerance if it scores by it this share of its score by the
      loosest one.
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
    bent: int = 4
    min_tolerance_score: float = 0.7

    def __post_init__(self) -> None:
        require_valid(self, shares=("crisp_ratio", "min_tolerance_score"))


@dataclass(frozen=True)
class AlignmentSettings:
    """Settings of the alignment, by step. ``quick`` refines many proposals, ``careful`` the best of them."""

    overlap: WallOverlapSettings = field(default_factory=WallOverlapSettings)
    icp: IcpSettings = field(default_factory=IcpSettings)
    quick: CoarseToFineSettings = field(default_factory=lambda: CoarseToFineSettings(max_points=500, last_steps=3))
    careful: CoarseToFineSettings = field(default_factory=CoarseToFineSettings)
    elastic: ElasticSettings = field(default_factory=ElasticSettings)
    contradiction: ContradictionSettings = field(default_factory=ContradictionSettings)
    hypotheses: HypothesisSettings = field(default_factory=HypothesisSettings)
