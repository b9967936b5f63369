"""Walls that the fusion of a team's maps loses, and the quality of the fused map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from benchmarks.team_injection.drawn_team import DrawnSettings, draw_team
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.grid.resampling import resampled
from mapquilt.evaluation.map_quality import WALL_TOLERANCE, map_quality, observed_part
from merge.fusion import FUSIONS, FusionName, fuse
from worlds.families.registry import make_world
from worlds.raster import true_raster

SAME_WALL = 0.3
"""Largest distance of two maps' drawings of one wall [m]."""

WORLDS = ("office", "house", "maze", "warehouse")
DRIFTS = (0.01, 0.03, 0.05)
"""Drift of the poses [m per root metre], from that of a good SLAM to that of odometry."""

FusionTrial = dict[FusionName, tuple[float, float, float]]
"""By rule: share of lost walls, F1 of the walls, intersection over union of the free cells."""


def fusion_trial(seed: int) -> FusionTrial:
    """Fuse a drawn team's maps, as trinary files have them, by each rule."""
    rng = np.random.default_rng(seed)
    world = make_world(WORLDS[seed % len(WORLDS)], seed, 24.0, 16.0)
    drift = DRIFTS[seed % len(DRIFTS)]
    team = draw_team(world, DrawnSettings(maps=2 + seed % 5, drift=drift, reach=8.0, range=8.0), rng)
    first, raster = team.world_from_map[0], true_raster(world, 0.05)
    maps = [OccupancyGrid.from_occupancy(grid.frame, grid.occupancy()) for grid in team.maps.grids]
    seen = [
        OccupancyGrid(raster.frame, resampled(grid, place, raster.frame))
        for grid, place in zip(maps, team.world_from_map, strict=True)
    ]
    truth = observed_part(raster, seen)
    placed = [(first.inverse() @ place, grid) for place, grid in zip(team.world_from_map, maps, strict=True)]
    trial: FusionTrial = {}
    for rule in FUSIONS:
        fused = fuse(maps[0].frame, placed, rule)
        walls = [resampled(grid, place, fused.frame, 2) > 0.0 for place, grid in placed]
        quality = map_quality(fused, first, truth)
        lost = lost_share(fused.occupied, walls, fused.frame.resolution)
        trial[rule] = (lost, quality.f1_walls, quality.iou_free)
    return trial


def lost_share(fused: NDArray[np.bool_], walls: Sequence[NDArray[np.bool_]], resolution: float) -> float:
    """Return the share of wall cells that another map shows too, of which the fused map shows neither drawing."""
    away = distance_transform_edt(~fused) * resolution
    nearest = [distance_transform_edt(~wall, return_indices=True) for wall in walls]
    lost = shared = 0
    for index, wall in enumerate(walls):
        cells = np.nonzero(wall)
        both, shown = np.zeros(cells[0].size, bool), away[cells] <= WALL_TOLERANCE
        for distance, places in (each for other, each in enumerate(nearest) if other != index):
            near = distance[cells] * resolution <= SAME_WALL
            both |= near
            shown |= near & (away[tuple(place[cells] for place in places)] <= WALL_TOLERANCE)
        shared += int(both.sum())
        lost += int((both & ~shown).sum())
    return lost / max(1, shared)
