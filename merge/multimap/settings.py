"""Settings of the steps that merge more than two maps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from mapping.validation import require_valid
from merge.retrieval.settings import RetrievalSettings


@dataclass(frozen=True)
class PairSelectionSettings:
    """Selection of the pairs of a large team that are matched.

    - ``rounds``: pairs are selected so often; maps that one round did not join are tried with others in the next;
    - ``partners``: each map is matched with this many others a round. Five keep a team connected although a third of
      its pairs are refused;
    - ``coarse_scale_step``, ``coarse_cells``, ``coarse_peaks``, ``coarse_proposals``: the search that ranks pairs, as
      in ``NormalCorrelation``, so coarse that it costs a twentieth of a match;
    - ``coarse_points``: wall points on which its poses are scored;
    - ``block_maps``: pairs are ranked in blocks of so many maps by so many, so that a worker prepares a map once;
    - ``min_indexed_maps``: from so many maps of known scale on, an index of wall patches ranks the pairs instead
      (``merge.retrieval``). All pairs of 40 maps cost as much as matching 40 pairs;
    - ``indexed_partners``, ``indexed_rounds``: the same numbers for such a team;
    - ``index_cells``: the poses that the index suggests are scored on maps of so many cells at most: cells of
      10 cm for maps of 20 x 20 m, which take a quarter of the memory of cells of 5 cm;
    - ``index_block_maps``: in blocks of so many maps by so many;
    - ``bridge_candidates``: in every round so many alignments of each cluster with larger ones are measured, or
      ``member_candidates`` for each of its maps if that is more;
    - ``bridge_pairs``: of an alignment that is probably right so many pairs are matched;
    - ``distinct_bridges`` [of a map's diagonal]: alignments that shift it less are one;
    - ``guided_partners``: and maps of such a team are matched where their cluster predicts it until each has so many
      partners. Cycles reject wrong answers, and three close enough of them.
    """

    rounds: int = 2
    partners: int = 5
    coarse_scale_step: float = 1.12
    coarse_cells: int = 48
    coarse_peaks: int = 2
    coarse_proposals: int = 6
    coarse_points: int = 400
    block_maps: int = 10
    min_indexed_maps: int = 40
    indexed_partners: int = 3
    indexed_rounds: int = 8
    index_cells: int = 60_000
    index_block_maps: int = 50
    bridge_candidates: int = 24
    member_candidates: int = 6
    bridge_pairs: int = 3
    distinct_bridges: float = 0.12
    guided_partners: int = 4


@dataclass(frozen=True)
class EdgeSettings:
    """The covariance and the log-odds with which the answer of a pair enters the graph of maps.

    - ``min_sigma_share`` [of the smaller map's diagonal], ``min_yaw_sigma`` [rad], ``min_log_scale_sigma``: two right
      answers may differ so much although nothing shows it, because each fits its own part of maps that drift;
    - ``max_sigma_share`` [of the smaller map's diagonal]: no answer is less certain, or it would agree with any other;
    - ``min_log_odds``: of an answer that was accepted, however uncertain it is;
    - ``max_log_odds``: no answer is so certain that others cannot outweigh it.
    """

    min_sigma_share: float = 0.01
    min_yaw_sigma: float = math.radians(0.7)
    min_log_scale_sigma: float = 0.01
    max_sigma_share: float = 0.05
    min_log_odds: float = 0.2
    max_log_odds: float = 3.0


@dataclass(frozen=True)
class OverlapLikelihoodSettings:
    """Log-odds of a relative pose, from the fraction of the compared walls that lie on walls.

    - ``points``: wall points that are compared;
    - ``min_compared_cells``: walls compared over less than this length say nothing;
    - ``full_compared_cells``: from this length on they count in full;
    - ``neutral_fraction``: right and wrong poses are equally likely here;
    - ``saturation``: so far from it the log-odds reach ``max_log_odds`` or ``min_log_odds``. Walls in free space are a
      plain contradiction, so they weigh more;
    - ``hopeless_fraction``: a pose with less is not refined first, since none nearby fits;
    - ``max_shift_share`` [of the smaller map's diagonal]: refinement may move the pose so far, because the errors of a
      chain of answers add up;
    - ``prepared_cells``: maps of so many cells in all are kept prepared, to bound memory; a million takes 25 MB.
    """

    points: int = 400
    min_compared_cells: float = 40.0
    full_compared_cells: float = 200.0
    neutral_fraction: float = 0.65
    saturation: float = 0.25
    hopeless_fraction: float = 0.4
    max_log_odds: float = 2.0
    min_log_odds: float = -3.0
    max_shift_share: float = 0.03
    prepared_cells: int = 50_000_000


@dataclass(frozen=True)
class ClusteringSettings:
    """Clusters of maps whose answers agree.

    - ``agreement_quantile``: of right answers this fraction passes the chi-square test of agreement;
    - ``cycle_log_odds``: an answer gains so much in a triangle of answers that closes, and loses it in one that does
      not, where the two others are right;
    - ``cycle_iterations``: of the fixed point between the answers of all triangles;
    - ``min_edge_log_odds``, ``max_edge_log_odds``: bounds of the log-odds of an answer after that;
    - ``restarts``: clusters are grown again from so many of the answers that the first clusters contradict;
    - ``refits``: at most so often edges and poses of a cluster are adapted to one another;
    - ``prior_maps``: in a team of so many maps, of which each meets three others, a third of the pairs match, as the
      confidence of an answer supposes; in an indexed team of N maps an answer has log(N / ``prior_maps``) less;
    - ``sure_log_odds``: maps of such a team join at first by answers that have at least this before;
    - ``guided_log_odds``: pairs of a cluster whose cells say at least this are matched again where the cluster puts
      them.
    """

    agreement_quantile: float = 0.999
    cycle_log_odds: float = 2.0
    cycle_iterations: int = 6
    min_edge_log_odds: float = -4.0
    max_edge_log_odds: float = 8.0
    restarts: int = 6
    refits: int = 3
    prior_maps: int = 10
    sure_log_odds: float = 3.0
    guided_log_odds: float = 0.5


@dataclass(frozen=True)
class OutlierRejectionSettings:
    """The search for wrong answers inside a cluster.

    - ``alignments``: poses that are evaluated for each part of a cluster;
    - ``shifts``: of all parts so many shifts are tried;
    - ``suspects``: of the answers that the others contradict so many are tried to be left out;
    - ``min_first_gain`` [log-odds]: a shift may lose so much at first, because one noisy answer puts a part less well
      than all do that then agree;
    - ``min_gain`` [log-odds]: a change must win so much in the end;
    - ``max_cell_gain`` [log-odds]: the cells say no more for a pose that few answers support;
    - ``min_redundancy``: an edge of which the others control less than this fraction is a bridge, and not tested.
    """

    alignments: int = 8
    shifts: int = 3
    suspects: int = 6
    min_first_gain: float = -3.0
    min_gain: float = 0.25
    max_cell_gain: float = 12.0
    min_redundancy: float = 1e-6


@dataclass(frozen=True)
class JointIcpSettings:
    """The joint refinement of all poses of a cluster on the cells.

    - ``rounds``: of correspondences and least squares, the gate narrowing from one to the next;
    - ``points``: wall points of a map that take part;
    - ``gate_tolerances``: at last walls may lie so many tolerances of their pair apart. Drift moves parts of a map
      against one another, and a narrower gate would keep only those that happen to fit;
    - ``first_gate_share`` [of the smaller map's diagonal]: at first they may lie at least so far apart;
    - ``max_score_loss``: walls may agree so much less in the end, because the mean of a distorted map fits no part
      best;
    - ``stiffness``: holds a pair whose walls let it slide, as a share of what its walls hold.
    """

    rounds: int = 6
    points: int = 1500
    gate_tolerances: float = 4.0
    first_gate_share: float = 0.02
    max_score_loss: float = 0.02
    stiffness: float = 1e-3


@dataclass(frozen=True)
class ClusterMergingSettings:
    """Clusters joined although every pair between them was refused.

    - ``min_agreeing_refusals``: so many refused answers, each of another pair, must agree first. One alone would be
      accepted twice on the same evidence.
    """

    min_agreeing_refusals: int = 2


@dataclass(frozen=True)
class StraighteningSettings:
    """Straightening of a map by its own walls, before it is bent onto others.

    - ``node_share`` [of the map's diagonal]: distance of the nodes of the control grid; about the width of a room;
    - ``blur_elements``: the direction of walls is averaged over so many elements of the grid, as a standard deviation;
    - ``stiffness``: weight of the mean squared strain against that of the mean squared turn [rad];
    - ``max_turn_deg``: walls that need more are oblique, and no drift;
    - ``min_parallel_share``: least share of the walls within that, those counted less whose neighbours are oblique.
      Caves reach 0.02 to 0.08, drifted buildings 0.26 to 0.6;
    - ``min_turn_deg``: maps whose walls need less, at the median, stay. Maps of SLAM at noise 2 need 0.2 to 0.6
      degrees, those of odometry 1.2 to 4.6; the raster makes 0.1 to 0.3;
    - ``min_points``: least number of wall points.
    """

    node_share: float = 0.05
    blur_elements: float = 1.0
    stiffness: float = 0.1
    max_turn_deg: float = 12.0
    min_parallel_share: float = 0.18
    min_turn_deg: float = 0.9
    min_points: int = 100

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_parallel_share",))


@dataclass(frozen=True)
class ElasticFusionSettings:
    """Elastic merging: maps bend onto those placed before them.

    - ``min_common_cells``: a map bends only if so many cells of its walls lie on walls of the others, by the loosest
      tolerance;
    - ``min_gain``: it stays rigid unless this share more of its compared walls then lies on walls, by the tightest
      tolerance;
    - ``node_share`` [of the distance of the nodes of one bend]: distance of the nodes of the bends in the result, which
      join several;
    - ``straightening``: of each map by itself, before.
    """

    min_common_cells: float = 40.0
    min_gain: float = 0.05
    node_share: float = 0.5
    straightening: StraighteningSettings = field(default_factory=StraighteningSettings)

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_gain",))


@dataclass(frozen=True)
class MultimapSettings:
    """Settings of the merge of more than two maps, by step."""

    retrieval: RetrievalSettings = field(default_factory=RetrievalSettings)
    selection: PairSelectionSettings = field(default_factory=PairSelectionSettings)
    edges: EdgeSettings = field(default_factory=EdgeSettings)
    likelihood: OverlapLikelihoodSettings = field(default_factory=OverlapLikelihoodSettings)
    clustering: ClusteringSettings = field(default_factory=ClusteringSettings)
    rejection: OutlierRejectionSettings = field(default_factory=OutlierRejectionSettings)
    joint_icp: JointIcpSettings = field(default_factory=JointIcpSettings)
    merging: ClusterMergingSettings = field(default_factory=ClusterMergingSettings)
    elastic: ElasticFusionSettings = field(default_factory=ElasticFusionSettings)
