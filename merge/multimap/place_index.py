"""Relative poses of the maps of a large team that an index of wall patches suggests, scored on the walls of both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment.hypotheses import rank_proposals, ranked
from merge.multimap.team import Team, in_wide_cells
from merge.pair.feature_cache import FeatureCache, metres_from_prepared, prepare_map
from merge.preparation.prepared_map import PreparedMap
from merge.records.proposal import Proposal
from merge.retrieval.relative_poses import RelativePoses
from merge.retrieval.similar_places import suggest_poses
from merge.retrieval.wall_patches import WallPatches, describe_walls
from merge.settings import MergeSettings


def indexed_poses(team: Team) -> RelativePoses:
    """Score how well the walls of two maps fit by the poses that the index suggests, each moved to the walls nearby."""
    settings = team.settings.multimap
    described = team.run(describe, [DescribeTask(grid, team.settings) for grid in team.maps.grids])
    poses = suggest_poses(described, settings.retrieval)
    tasks = [
        PlacesTask({int(k): team.maps.grids[k] for k in {*part.targets, *part.sources}}, part, team.settings)
        for part in _in_pose_blocks(poses, settings.selection.index_block_maps)
    ]
    return RelativePoses.joined(team.run(score_places, tasks))


def _in_pose_blocks(poses: RelativePoses, maps: int) -> list[RelativePoses]:
    """Group poses to blocks of so many maps by so many."""
    _, block = np.unique(np.stack((poses.targets // maps, poses.sources // maps)), axis=1, return_inverse=True)
    return [poses[np.flatnonzero(block.ravel() == k)] for k in range(int(block.max(initial=-1)) + 1)]


@dataclass(frozen=True, eq=False)
class PlacesTask:
    """Maps by index, and poses between them to score."""

    grids: Mapping[int, OccupancyGrid]
    poses: RelativePoses
    settings: MergeSettings


def score_places(task: PlacesTask, cache: FeatureCache | None = None) -> RelativePoses:
    """Move the poses to the walls nearby, and score how well those fit, on coarse cells."""
    maps = {index: CoarseMap.of(grid, task.settings) for index, grid in sorted(task.grids.items())}
    starts = [*task.poses.first_of_pairs().tolist(), len(task.poses)]
    rows: list[tuple[int, int, Similarity2, float]] = []
    for first, last in pairwise(starts):
        a, b = int(task.poses.targets[first]), int(task.poses.sources[first])
        target, source = maps[a], maps[b]
        poses = task.poses.target_from_source[np.arange(first, last)].similarities()
        proposals = [Proposal(target.metres.inverse() @ pose @ source.metres) for pose in poses]
        scale = source.metres.scale / target.metres.scale
        found = rank_proposals(
            target.prepared, source.prepared, proposals, ScaleRange(scale, scale), task.settings.alignment
        )
        for each in ranked(found):
            metric = target.metres @ each.target_from_source @ source.metres.inverse()
            rows.append((a, b, metric, each.mean_score))
    targets, sources, moved, scores = zip(*rows, strict=True) if rows else ((), (), (), ())
    return RelativePoses(
        np.array(targets, np.intp), np.array(sources, np.intp), Similarity2Array.of(moved), np.array(scores, np.float64)
    )


@dataclass(frozen=True, eq=False)
class CoarseMap:
    """A map in wide cells; ``metres`` leads from those to metres of the map."""

    prepared: PreparedMap
    metres: Similarity2

    @staticmethod
    def of(grid: OccupancyGrid, settings: MergeSettings) -> CoarseMap:
        prepared = prepare_map(grid, in_wide_cells(settings))
        return CoarseMap(prepared, metres_from_prepared(grid.frame, prepared))


@dataclass(frozen=True, eq=False)
class DescribeTask:
    """A map to describe for the index."""

    grid: OccupancyGrid
    settings: MergeSettings


def describe(task: DescribeTask, cache: FeatureCache | None = None) -> WallPatches:
    """Describe the wall patches of a map."""
    prepared = prepare_map(task.grid, task.settings.preparation)
    metres = metres_from_prepared(task.grid.frame, prepared)
    return describe_walls(prepared, metres, task.settings.multimap.retrieval.patches)
