"""Maps stitched at their start poses, which are trusted and not verified."""

from __future__ import annotations

from mapping.geometry.similarity2 import Similarity2
from mapping.grid.pixel_matrix import pixel_matrix
from merge.multimap.graph import Cluster, Pair
from merge.multimap.team import Solution, Team
from merge.records.result import PairResult


def stitch(team: Team) -> Solution:
    """Join all maps at their start poses; the frame of a map without one is the frame that the poses share.

    Scales are those that the maps state. Raises ``ValueError`` naming a map without a resolution.
    """
    for name, unit in zip(team.maps.names, team.maps.units, strict=True):
        if unit != "m":
            raise ValueError(f"trust_priors: {name} states no resolution [m]; give it a map_server YAML")
    start = {prior.name: prior.common_from_map for prior in team.settings.priors}
    common_from_map = [start.get(name, Similarity2.identity()) for name in team.maps.names]
    common_from_local = [
        pose @ frame.metres_from_local for pose, frame in zip(common_from_map, team.frames, strict=True)
    ]
    root = common_from_local[0].inverse()
    poses = {index: root @ pose for index, pose in enumerate(common_from_local)}
    pairs = {pair: _stitched(team, pair, common_from_map) for pair in team.pairs}
    return Solution((Cluster(poses, ()),), pairs)


def _stitched(team: Team, pair: Pair, common_from_map: list[Similarity2]) -> PairResult:
    """Return the answer of a pair that nothing verified: its confidence is 0."""
    task = team.task(pair)
    target, source = (team.index(name) for name in task.names)
    relative = common_from_map[target].inverse() @ common_from_map[source]
    frames = task.grids[0].frame, task.grids[1].frame
    return PairResult(
        *task.names,
        accepted=True,
        confidence=0.0,
        refusal=None,
        target_from_source=relative,
        target_from_source_pixels=pixel_matrix(frames[0], relative, frames[1]),
        unit=task.units[0],
        evidence=None,
        decided_by="trusted_prior",
    )
