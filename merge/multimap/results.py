"""The result of a merge, from the solution of a team."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.fusion import finest, fuse_and_compare
from merge.multimap.elastic_fusion import bend_group
from merge.multimap.graph import Cluster
from merge.multimap.team import Solution, Team
from merge.records.bent_map import bent_grid
from merge.records.result import MergedGroup, MergeResult, PairResult

CALIBRATED = "quilt"
"""The method whose answers the acceptance was fitted to."""


def merge_result(team: Team, solution: Solution) -> MergeResult:
    """Fuse each cluster in the frame of its reference, by default its first map, and order pairs and maps as given."""
    in_given_order = sorted(
        solution.answers, key=lambda pair: sorted(team.rank[team.maps.names[index]] for index in pair)
    )
    pairs = tuple(solution.answers[pair] for pair in in_given_order)
    merged = [_merged(team, cluster) for cluster in solution.clusters]
    merged.sort(key=lambda group: _rank(team, group), reverse=True)
    first = merged[0].reference_from_map
    left_out = {name: _why_left_out(name, merged, pairs) for name in team.names if name not in first}
    calibrated = team.settings.method == CALIBRATED and not team.settings.as_published
    return MergeResult(team.names, pairs, tuple(merged), left_out, calibrated)


def _merged(team: Team, cluster: Cluster) -> MergedGroup:
    """Fuse a cluster; elastically, if asked, and if fewer walls then lie in the free space of other maps."""
    names = [name for name in team.names if team.index(name) in cluster.poses]
    reference = str(team.settings.reference) if team.settings.reference in names else names[0]
    placed = {name: team.metric(cluster, reference, name) for name in names}
    placed[reference] = Similarity2.identity()
    grid_of = dict(zip(team.maps.names, team.maps.grids, strict=True))
    frame = grid_of[reference].cropped().frame
    if team.maps.metric:
        frame = finest(frame, [grid_of[name].frame.resolution * pose.scale for name, pose in placed.items()])
    members = [name for name in team.maps.names if name in placed]
    grids = [(placed[name], grid_of[name].cropped()) for name in members]
    rigid = _fused(team, frame, placed, reference, grids)
    if not team.settings.elastic or len(members) == 1:
        return rigid
    bends = bend_group([(placed[name], grid_of[name]) for name in members], team.settings, team.run.cache)
    found = dict(zip(members, bends, strict=True))
    bent = {name: bend for name in names if (bend := found[name]) is not None}
    grids = [
        (place, bent_grid(grid_of[name], bent[name].bend) if name in bent else grid)
        for name, (place, grid) in zip(members, grids, strict=True)
    ]
    elastic = dataclasses.replace(_fused(team, frame, placed, reference, grids), bends=bent)
    better = elastic if elastic.conflict_cells < rigid.conflict_cells else rigid
    return dataclasses.replace(better, rigid_conflict_cells=rigid.conflict_cells)


def _fused(
    team: Team,
    frame: GridFrame,
    placed: Mapping[str, Similarity2],
    reference: str,
    grids: Sequence[tuple[Similarity2, OccupancyGrid]],
) -> MergedGroup:
    fused = fuse_and_compare(frame, grids, team.settings.fusion, team.settings.merged_grid)
    return MergedGroup(reference, placed, fused.merged, fused.conflicts, fused.doubled_walls)


def _rank(team: Team, group: MergedGroup) -> tuple[bool, int, int, int]:
    """Order groups: that of the chosen reference, the one of most maps, of most known cells, and as maps were given."""
    has_reference, size = team.settings.reference in group.reference_from_map, len(group.reference_from_map)
    known = int(np.count_nonzero(group.merged.known)) if size > 1 else 0
    return has_reference, size, known, -team.names.index(next(iter(group.reference_from_map)))


def _why_left_out(name: str, merged: Sequence[MergedGroup], pairs: Sequence[PairResult]) -> str:
    """Explain why a map is not in the first group: its most confident pair with a map of it, and its own group."""
    first = merged[0].reference_from_map
    tried = [pair for pair in pairs if name in (pair.target, pair.source) and {pair.target, pair.source} & first.keys()]
    surest = max(tried, key=lambda pair: pair.confidence)
    other = surest.source if surest.target == name else surest.target
    own = next(group.reference_from_map for group in merged if name in group.reference_from_map)
    beside = [one for one in own if one != name]
    instead = f"; joined with {', '.join(beside)} instead" if beside else ""
    return f"with {other}: {surest.reason_text}{instead}"
