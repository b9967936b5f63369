"""Settings of the measurements and of the acceptance of an answer."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from mapping.validation import require_valid


@dataclass(frozen=True)
class WallOverlapSettings:
    """When two walls count as one.

    - ``tolerance_shares`` [of the smaller map's diagonal]: the walls may be so far apart, loosest first: from what
      distorted maps need to what crisp maps meet;
    - ``min_tolerance_cells``: the tolerance is at least so many cells of the coarser map;
    - ``min_normal_cosine``: cosine of the largest angle between the normals; 0.5 is 60 degrees.
    """

    tolerance_shares: tuple[float, ...] = (0.014, 0.010, 0.007, 0.0035, 0.002)
    min_tolerance_cells: float = 1.5
    min_normal_cosine: float = 0.5

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_normal_cosine",))
        if sorted(self.tolerance_shares, reverse=True) != list(self.tolerance_shares):
            raise ValueError(f"WallOverlapSettings: tolerance_shares is {self.tolerance_shares}, must not rise")


@dataclass(frozen=True)
class UncertaintySettings:
    """The covariance of an answer.

    - ``patch_share`` [of the smaller map's diagonal]: side of a patch whose walls have one common error;
    - ``variance_inflation``: factor on the variance that the patches show, because drift makes the errors of
      neighbours dependent. With both, the mean normalised squared error of accepted right answers on generated pairs
      is 2 to 8 at every noise level, by SLAM and at odometry (docs/merger.md); 4, the number of parameters, is exact;
    - ``patch_sigma_cells``: least standard deviation of a patch, in cells of the coarser map, because walls lie
      between cells;
    - ``cell_sigma_cells``: standard deviation of each wall cell by itself, in cells of the coarser map, because a
      raster rounds it;
    - ``min_normal_isotropy``: below it all matched walls count as parallel: what they say of a shift along
      themselves is the raggedness of their cells; as in ``AcceptanceSettings``;
    - ``max_points``: wall points that are paired;
    - ``gate_tolerances``: two walls are paired if they are at most so many of the loosest tolerances apart;
    - ``log_scale_sigma``: standard deviation of the log scale where nothing determines it.
    """

    patch_share: float = 0.2
    variance_inflation: float = 5.0
    patch_sigma_cells: float = 0.15
    cell_sigma_cells: float = 0.3
    min_normal_isotropy: float = 0.08
    max_points: int = 4000
    gate_tolerances: float = 2.0
    log_scale_sigma: float = math.log(2.0)

    def __post_init__(self) -> None:
        require_valid(self, shares=("min_normal_isotropy",))


@dataclass(frozen=True)
class AcceptanceSettings:
    """Constants of ``decide``; lengths in cells of the coarser map.

    The log-odds that the answer is right are ``margin_weight`` times the margin, less ``contradiction_weight`` times
    the contradiction, less ``conflict_weight`` times the conflict, less ``threshold``. The margin is the score less the
    second best score. The contradiction is the share of the compared walls that lie in free space although the source
    was bent; the conflict is the share of them in long pieces. Neither depends on the overlap: a wrong place where
    little overlaps pays as much. ``mapquilt calibrate`` fitted about these weights to generated pairs with and without
    disturbances, and to maps of other storeys; the last two are somewhat larger and the threshold is higher by 1.5,
    because more pairs of a team do not match than the third that the fit assumes. The score itself got no weight.

    - ``margin_cap``: a larger margin counts as this, or a poor answer would pass for want of any other;
    - ``min_inlier_length_cells``, ``min_normal_isotropy``: the matched walls must be so long, and run in more than one
      direction;
    - ``min_overlap``: the maps must share this fraction of the area that the smaller one knows;
    - ``min_score``: an answer that scores less is refused, whether there is a second best or not;
    - ``min_relative_margin``: the margin must be this fraction of the score, however good the rest;
    - ``min_confidence``: an answer of less confidence is refused.
    - ``missing_log_odds``: an answer that fails one of these minima has less than minus this log-odds.
    """

    margin_weight: float = 20.0
    contradiction_weight: float = 12.0
    conflict_weight: float = 20.0
    threshold: float = 1.2
    margin_cap: float = 0.3
    min_inlier_length_cells: float = 50.0
    min_normal_isotropy: float = 0.08
    min_overlap: float = 0.1
    min_score: float = 0.2
    min_relative_margin: float = 0.1
    min_confidence: float = 0.6
    missing_log_odds: float = 2.0

    def __post_init__(self) -> None:
        signed, shares = ("threshold",), ("min_confidence",)
        names = (field.name for field in dataclasses.fields(self))
        not_negative = tuple(name for name in names if name not in signed + shares)
        require_valid(self, not_negative=not_negative, shares=shares, signed=signed)
