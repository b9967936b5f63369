"""What the method makes of a team's maps: the values behind the pictures."""

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
class Settled:
    """One quarter turn's agreement, where ICP settled it, and the acceptance index before and after; None without a
    common cell. Transforms take cells to cells."""

    agreement: CornerMatch
    target_from_source: Similarity2
    index_before: float | None
    index: float | None


@dataclass(frozen=True, eq=False)
class PairSteps:
    """Two corrected maps by their places in the team; what each quarter turn settled at, the best index first."""

    target: int
    source: int
    settled: tuple[Settled, ...]


@dataclass(frozen=True, eq=False)
class TeamSteps:
    names: tuple[str, ...]
    maps: tuple[CorrectedMap, ...]
    pairs: tuple[PairSteps, ...]


def corrected_maps(grids: Sequence[OccupancyGrid]) -> tuple[CorrectedMap, ...]:
    """Each map corrected, in cells, with the margin that the merger gives it."""
    method = Morphology()
    return tuple(method.describe(PreparedMap(_in_cells(grid))) for grid in grids)


def _in_cells(grid: OccupancyGrid) -> OccupancyGrid:
    cropped = grid.cropped(PreparationSettings.border_cells)
    return OccupancyGrid(GridFrame(1.0, SE2.identity(), cropped.frame.shape), cropped.log_odds)


def team_steps(maps: MapSet, scale: ScaleRange) -> TeamSteps:
    """Every map corrected and every pair matched; ``scale`` as in the settings of a merge."""
    corrected = corrected_maps(maps.grids)
    pairs = []
    for target, source in itertools.combinations(range(len(maps)), 2):
        cells = 1.0
        if "cell" not in (maps.units[target], maps.units[source]):
            cells = maps.grids[source].frame.resolution / maps.grids[target].frame.resolution
        pairs.append(PairSteps(target, source, settled(corrected[target], corrected[source], scale.times(cells))))
    return TeamSteps(maps.names, corrected, tuple(pairs))


def settled(target: CorrectedMap, source: CorrectedMap, scale: ScaleRange) -> tuple[Settled, ...]:
    """The best agreement of each quarter turn with what ICP makes of it, the greatest index first."""
    method = Morphology()
    found = []
    for each in best_of_each_quadrant(method.agreed(target, source, scale)):
        place = icp(target.walls, source.walls, each.target_from_source, scale, method.icp)
        indices = [
            compare_cells(target.grid, source.grid, t).acceptance_index for t in (each.target_from_source, place)
        ]
        found.append(Settled(each, place, *indices))
    return tuple(sorted(found, key=lambda one: -(one.index or 0.0)))


def notes(names: Sequence[str], maps: Sequence[CorrectedMap]) -> tuple[str, ...]:
    """What must be said of the corrections: which maps have no main direction."""
    return tuple(
        f"{name}: {each.correction.note}" for name, each in zip(names, maps, strict=True) if each.correction.note
    )


def steps_record(team: TeamSteps) -> dict[str, Any]:
    """Numbers of every step; schema ``steps``."""
    return {
        "schema": "mapquilt-steps/1",
        "maps": [_map_record(name, each) for name, each in zip(team.names, team.maps, strict=True)],
        "pairs": [
            {
                "target": team.names[pair.target],
                "source": team.names[pair.source],
                "quarters": [_settled_record(one) for one in pair.settled],
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


def _settled_record(one: Settled) -> dict[str, Any]:
    return {
        "yaw_deg": math.degrees(one.target_from_source.yaw),
        "scale": one.target_from_source.scale,
        "inliers": one.agreement.inliers,
        "index_before": one.index_before,
        "index": one.index,
    }
