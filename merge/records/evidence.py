"""Evidence for and against a transform."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Evidence:
    """Measurements of one transform. Swapping the maps gives the same, up to rounding.

    - ``acceptance_index``: share of the commonly known cells that agree (Birk and Carpin 2006); None without any;
    - ``wall_inlier_ratio``: share of the walls in the overlap that lie on a wall of the other map with the same
      orientation; None without any;
    - ``free_space_violation``: share of them that lie deep inside the other map's free space; None without any;
    - ``deep_free_space_violation``: the same by the loosest tolerance, which correct answers of distorted maps meet;
    - ``common_known_cells``: area that both maps know, in cells of the coarser map;
    - ``overlap``: that area as a share of the known area of the map that knows less;
    - ``tolerance_cells``: largest distance of two walls that count as one, in cells of the coarser map: the crisper
      the maps, the smaller;
    - ``inlier_length_cells``: length of the matched walls, in cells of the coarser map;
    - ``normal_isotropy``: 0 if all matched walls are parallel, 1/2 if both directions have the same length;
    - ``score``: the alignment score after the source was bent onto the target, by that tolerance, less the cost of
      the strain, 0 to 1;
    - ``second_best_score``: the same of the best hypothesis elsewhere, 0 if there was none;
    - ``precision_probability``: probability, by the answer's covariance, that an answer at the right place is within 2
      degrees of rotation and 3 % of scale;
    - ``local_violation``: share of the walls in the overlap that lie in the other map's free space although the source
      was bent, so that drift does not explain it (``Contradiction``);
    - ``conflict_ratio``: share of them in long connected pieces; ``conflict_cells``: their number, in cells of the
      coarser map;
    - ``strain``: root mean square of the strain of the bend, 0 for a rigid motion. The four are None in records of
      older versions;
    - ``matches``, ``inliers``: point pairs of the method, and those that agree; None for a method without any;
    - ``votes``: number of proposals that converged to this answer;
    - ``alike_placements``: number of placements that fit alike because the place is symmetric, this one among them; 1
      if it is not, None if nobody asked, as for answers that are refused anyway.
    """

    acceptance_index: float | None
    wall_inlier_ratio: float | None
    free_space_violation: float | None
    deep_free_space_violation: float | None
    common_known_cells: float
    overlap: float
    tolerance_cells: float
    inlier_length_cells: float
    normal_isotropy: float
    score: float
    second_best_score: float
    precision_probability: float
    matches: int | None
    inliers: int | None
    votes: int
    local_violation: float | None = None
    conflict_ratio: float | None = None
    conflict_cells: float | None = None
    strain: float | None = None
    alike_placements: int | None = None
