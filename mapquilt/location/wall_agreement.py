"""Ask a map about the walls of a plan, and not the plan about the map's: it has furniture that no plan shows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.validation import require_valid
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.surface import nearest_points


@dataclass(frozen=True)
class WallAgreementSettings:
    """Set up the comparison of a plan's walls with a map.

    - ``tolerance_share`` [of the map's diagonal]: a wall may be so far off; little, because wrong places of alike
      buildings agree within more;
    - ``min_tolerance_cells`` [cells of the map]: it may be so far off in any case;
    - ``gates`` [tolerances]: greatest distance of paired walls in each step of the refinement; furniture is farther;
    - ``min_pairs``: with fewer pairs nothing is refined.
    """

    tolerance_share: float = 0.0035
    min_tolerance_cells: float = 2.0
    gates: tuple[float, ...] = (3.0, 3.0, 3.0, 2.0, 2.0, 1.5, 1.5, 1.0, 1.0)
    min_pairs: int = 50

    def __post_init__(self) -> None:
        require_valid(self)

    def tolerance_cells(self, scan: OccupancyGrid) -> float:
        """Return the tolerance [cells of the map]."""
        return max(self.min_tolerance_cells, self.tolerance_share * scan.known_diagonal / scan.frame.resolution)


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


def wall_faces(plan: OccupancyGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the cells of a plan's wall faces: their centres (N, 2) [m], and unit normals (N, 2) into the room, zero
    where there is free space on all sides."""
    prepared = PreparedMap(plan)
    turn = SE2(0.0, 0.0, plan.frame.origin.yaw)
    return plan.frame.metres_from_cells(prepared.points[:, ::-1] - 0.5), turn.apply(prepared.normals)


def wall_agreement(
    plan: OccupancyGrid,
    scan: OccupancyGrid,
    scan_from_plan: Similarity2,
    settings: WallAgreementSettings = WallAgreementSettings(),
) -> WallAgreement:
    """Compare the wall faces of a plan with a map at a transform from the metres of the one to those of the other."""
    faces, normals = wall_faces(plan)
    faces, normals = scan_from_plan.apply(faces), SE2(0.0, 0.0, scan_from_plan.yaw).apply(normals)
    tolerance = settings.tolerance_cells(scan)
    front = faces + math.ceil(tolerance + 1.0) * scan.frame.resolution * normals
    inside = scan.frame.contains(scan.frame.cells_from_metres(faces))
    inside &= scan.frame.contains(scan.frame.cells_from_metres(front))
    at, before = (tuple(scan.frame.cells_from_metres(each[inside]).T) for each in (faces, front))
    to_wall = cv2.distanceTransform((~scan.occupied).astype(np.uint8), cv2.DIST_L2, 5)
    depth = cv2.distanceTransform(scan.free.astype(np.uint8), cv2.DIST_L2, 5)
    confirmed = (to_wall[at] <= tolerance) & scan.free[before]
    denied = (to_wall[at] > tolerance) & (depth[at] > tolerance)
    return WallAgreement(int(confirmed.sum()), int(denied.sum()))


def refine_on_walls(
    plan: OccupancyGrid,
    scan: OccupancyGrid,
    scan_from_plan: Similarity2,
    settings: WallAgreementSettings = WallAgreementSettings(),
) -> Similarity2:
    """Refine a transform on the plan's walls alone, so that furniture of the map that is near no wall does not pull it.

    By point-to-line ICP (Chen and Medioni 1992) of the plan's wall faces to the map's surface that faces the same way,
    with gates that shrink. Returns the transform unchanged if the map then confirms a smaller share of the walls.
    """
    surface = PreparedMap(scan).surface
    points, directions = wall_faces(plan)
    cells_from_scan = Similarity2(scale=1.0 / scan.frame.resolution) @ Similarity2.from_se2(scan.frame.origin.inverse())
    cells_from_plan = cells_from_scan @ scan_from_plan
    for gate in settings.gates:
        moved, normals = cells_from_plan.apply(points), SE2(0.0, 0.0, cells_from_plan.yaw).apply(directions)
        indices, distances = nearest_points(surface, moved, normals)
        reach = gate * settings.tolerance_cells(scan)
        paired = (distances <= reach) & normals.any(axis=1)
        if np.count_nonzero(paired) < settings.min_pairs:
            return scan_from_plan
        moved, normals = moved[paired], normals[paired]
        weights = (1.0 - (distances[paired] / reach) ** 2) ** 2
        residuals = ((surface[0][indices[paired]] - moved) * normals).sum(axis=1)
        centre = moved.mean(axis=0)
        x, y = (moved - centre).T
        nx, ny = normals.T
        rows = np.stack((nx, ny, x * ny - y * nx, x * nx + y * ny), axis=1)
        weighed = rows * weights[:, None]
        change = np.linalg.lstsq(weighed.T @ rows, weighed.T @ residuals, rcond=1e-9)[0]
        step = Similarity2(change[0], change[1], change[2], math.exp(change[3]))
        shift = Similarity2(float(centre[0]), float(centre[1]))
        cells_from_plan = shift @ step @ shift.inverse() @ cells_from_plan
    refined = cells_from_scan.inverse() @ cells_from_plan
    before, after = (wall_agreement(plan, scan, each, settings).share for each in (scan_from_plan, refined))
    return refined if after >= before else scan_from_plan
