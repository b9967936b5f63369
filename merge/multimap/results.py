"""The answer for a team, told in the frames of its maps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mapping.geometry.similarity2 import Similarity2
from merge.fusion import finest, fuse_and_compare
from merge.multimap.cluster import Cluster
from merge.multimap.team import Team
from merge.records.result import MergedGroup, MergeResult, PairResult

CALIBRATED = "quilt"
"""The method whose answers the constants of the decision were fitted to."""


def merge_result(team: Team, groups: Sequence[Cluster]) -> MergeResult:
    """The result of a team that is solved."""
    pairs = team.verdicts(groups)
    told = [_told(team, group) for group in groups]
    told.sort(key=lambda group: _rank(team, group), reverse=True)
    first = told[0].reference_from_map
    left_out = {name: _why_not(name, told, pairs) for name in team.names if name not in first}
    calibrated = team.settings.method == CALIBRATED and not team.settings.as_published
    return MergeResult(team.names, tuple(pairs), tuple(told), left_out, calibrated)


def _told(team: Team, group: Cluster) -> MergedGroup:
    names = [name for name in team.names if team.place(name) in group.poses]
    reference = _reference(team, group, names)
    placed = {name: team.metric(group, reference, name) for name in names}
    placed[reference] = Similarity2.identity()
    grid_of = dict(zip(team.maps.names, team.maps.grids, strict=True))
    frame = grid_of[reference].cropped().frame
    if team.trusted:
        frame = finest(frame, [grid_of[name].frame.resolution * place.scale for name, place in placed.items()])
    grids = [(placed[name], grid_of[name].cropped()) for name in team.maps.names if name in placed]
    fused = fuse_and_compare(frame, grids, team.settings.fusion)
    return MergedGroup(reference, placed, fused.merged, fused.conflicts)


def _reference(team: Team, group: Cluster, names: Sequence[str]) -> str:
    """The map that was asked for, else that which knows the largest area where the group puts it; the one that comes
    first by what it holds, of equals."""
    if team.settings.reference in names:
        return str(team.settings.reference)
    return max(sorted(names, key=team.place), key=lambda name: _area(team, group, name))


def _area(team: Team, group: Cluster, name: str) -> float:
    index = team.place(name)
    return round(float(team.grounds[index].area * group.poses[index].scale ** 2), 3)


def _rank(team: Team, group: MergedGroup) -> tuple[bool, int, int, int]:
    asked = team.settings.reference in group.reference_from_map
    known = int(np.count_nonzero(group.merged.known))
    return asked, len(group.reference_from_map), known, -min(team.place(name) for name in group.reference_from_map)


def _why_not(name: str, told: Sequence[MergedGroup], pairs: Sequence[PairResult]) -> str:
    """Why a map is not in the first group: its best pair with one that is, and with whom it was joined instead."""
    joined = told[0].reference_from_map
    tried = [pair for pair in pairs if name in (pair.target, pair.source)]
    refused = [pair for pair in tried if {pair.target, pair.source} & joined.keys()]
    nearest = max(refused, key=lambda pair: pair.confidence)
    other = nearest.source if nearest.target == name else nearest.target
    with_others = next(group.reference_from_map for group in told if name in group.reference_from_map)
    beside = [one for one in with_others if one != name]
    instead = f"; joined with {', '.join(beside)} instead" if beside else ""
    return f"with {other}: {nearest.reason_text}{instead}"
