"""Intermediate results of the method ``morphology`` on a team's maps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.literature.chen2021.corner_consensus import CornerMatch
from merge.literature.chen2021.morphology import CorrectedMap, Morphology, best_of_each_quadrant
from merge.literature.chen2021.wall_icp import icp
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.settings import PreparationSettings
from merge.verification.cell_overlap import compare_cells


@dataclass(frozen=True, eq=False)
class RefinedMatch:
    """Hold the corner match of one quarter turn, the transform after ICP (cells to cells), and the acceptance index
    before and after ICP, None without a common cell."""

    corners: CornerMatch
    target_from_source: Similarity2
    index_before: float | None
    index: float | None


@dataclass(frozen=True, eq=False)
class PairSteps:
    """Hold two corrected maps by index, and the result of each quarter turn, by falling acceptance index."""

    target: int
    source: int
    matches: tuple[RefinedMatch, ...]


@dataclass(frozen=True, eq=False)
class TeamSteps:
    names: tuple[str, ...]
    maps: tuple[CorrectedMap, ...]
    pairs: tuple[PairSteps, ...]


def corrected_maps(grids: Sequence[OccupancyGrid]) -> tuple[CorrectedMap, ...]:
    """Correct each map, in cells, with the margin that the merger gives it."""
    method = Morphology()
    return tuple(method.describe(PreparedMap(_in_cells(grid))) for grid in grids)


def _in_cells(grid: OccupancyGrid) -> OccupancyGrid:
    cropped = grid.cropped(PreparationSettings.border_cells)
    return OccupancyGrid(GridFrame(1.0, SE2.identity(), cropped.frame.shape), cropped.log_odds)


def team_steps(maps: MapSet, scale: ScaleRange) -> TeamSteps:
    """Correct every map and match every pair; ``scale`` as in the settings of a merge."""
    corrected = corrected_maps(maps.grids)
    pairs = []
    for target, source in itertools.combinations(range(len(maps)), 2):
        cells = 1.0
        if "cell" not in (maps.units[target], maps.units[source]):
            cells = maps.grids[source].frame.resolution / maps.grids[target].frame.resolution
        pairs.append(
            PairSteps(target, source, refined_matches(corrected[target], corrected[source], scale.times(cells)))
        )
    return TeamSteps(maps.names, corrected, tuple(pairs))


def refined_matches(target: CorrectedMap, source: CorrectedMap, scale: ScaleRange) -> tuple[RefinedMatch, ...]:
    """Refine the best corner match of each quarter turn by ICP, and sort by falling acceptance index."""
    method = Morphology()
    found = []
    for each in best_of_each_quadrant(method.agreed(target, source, scale)):
        place = icp(target.walls, source.walls, each.target_from_source, scale, method.icp)
        indices = [
            compare_cells(target.grid, source.grid, t).acceptance_index for t in (each.target_from_source, place)
        ]
        found.append(RefinedMatch(each, place, *indices))
    return tuple(sorted(found, key=lambda one: -(one.index or 0.0)))


def notes(names: Sequence[str], maps: Sequence[CorrectedMap]) -> tuple[str, ...]:
    """Return a warning for each map without a main direction."""
    return tuple(
        f"{name}: {each.correction.note}" for name, each in zip(names, maps, strict=True) if each.correction.note
    )


def steps_record(team: TeamSteps) -> dict[str, Any]:
    """Build the content of steps.json."""
    return {
        "schema": "mapquilt-steps/1",
        "maps": [_map_record(name, each) for name, each in zip(team.names, team.maps, strict=True)],
        "pairs": [
            {
                "target": team.names[pair.target],
                "source": team.names[pair.source],
                "quarters": [_match_record(one) for one in pair.matches],
            }
            for pair in team.pairs
        ],
    }


def _map_record(name: str, each: CorrectedMap) -> dict[str, Any]:
    found = each.correction
    return {
        "name": name,
        "direction_deg": math.degrees(found.direction.angle),
        "sharpness": found.direction.sharpness,
        "contrast": found.direction.contrast,
        "turned": found.direction.clear,
        "usual_thickness": found.thickness.usual,
        "thick_thickness": found.thickness.thick,
        "closing": found.closing,
        "half_tile": found.half,
        "interest_points": len(found.points),
        "corners": len(found.corners),
    }


def _match_record(one: RefinedMatch) -> dict[str, Any]:
    return {
        "yaw_deg": math.degrees(one.target_from_source.yaw),
        "scale": one.target_from_source.scale,
        "inliers": one.corners.inliers,
        "index_before": one.index_before,
        "index": one.index,
    }
