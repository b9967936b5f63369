"""Ask a map about the walls of a plan, and not the plan about the map's: it has furniture that no plan shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.preparation.prepared_map import PreparedMap


@dataclass(frozen=True)
class WallAgreementSettings:
    """Set up the comparison of a plan's walls with a map.

    - ``tolerance_share`` [of the map's diagonal]: a wall may be so far off; little, because wrong places of alike
      buildings agree within more;
    - ``min_tolerance_cells`` [cells of the map]: it may be so far off in any case.
    """

    tolerance_share: float = 0.0035
    min_tolerance_cells: float = 2.0

    def __post_init__(self) -> None:
        require_valid(self)


@dataclass(frozen=True)
class WallAgreement:
    """Count the cells of a plan's wall faces that a map ``confirmed`` as walls seen from that side, and those that it
    ``denied`` as free space."""

    confirmed: int
    denied: int

    @property
    def share(self) -> float:
        """Share of the faces that the map observed which it confirmed; 0 if it observed none."""
        return self.confirmed / max(1, self.confirmed + self.denied)


def wall_agreement(
    plan: OccupancyGrid,
    scan: OccupancyGrid,
    scan_from_plan: Similarity2,
    settings: WallAgreementSettings = WallAgreementSettings(),
) -> WallAgreement:
    """Compare the wall faces of a plan with a map at a transform from the metres of the one to those of the other."""
    prepared, resolution = PreparedMap(plan), scan.frame.resolution
    cells = prepared.points[:, ::-1] - 0.5
    faces = scan_from_plan.apply(plan.frame.metres_from_cells(cells))
    ahead = scan_from_plan.apply(plan.frame.metres_from_cells(cells + prepared.normals[:, ::-1])) - faces
    ahead /= np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-12)[:, None]
    tolerance = max(settings.min_tolerance_cells, settings.tolerance_share * scan.known_diagonal / resolution)
    front = faces + math.ceil(tolerance + 1.0) * resolution * ahead
    inside = scan.frame.contains(scan.frame.cells_from_metres(faces))
    inside &= scan.frame.contains(scan.frame.cells_from_metres(front))
    at, before = (tuple(scan.frame.cells_from_metres(each[inside]).T) for each in (faces, front))
    to_wall = cv2.distanceTransform((~scan.occupied).astype(np.uint8), cv2.DIST_L2, 5)
    depth = cv2.distanceTransform(scan.free.astype(np.uint8), cv2.DIST_L2, 5)
    confirmed = (to_wall[at] <= tolerance) & scan.free[before]
    denied = (to_wall[at] > tolerance) & (depth[at] > tolerance)
    return WallAgreement(int(confirmed.sum()), int(denied.sum()))
