"""A moment of a live merge as a merge of files: a folder with the same poses, which ``mapquilt merge`` extends."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from mapping.geometry.similarity2 import Similarity2
from mapping.io.map_file import map_files
from mapping.map_set import MapSet
from mapquilt.live.live_merger import LiveState
from mapquilt.live.settings import LiveSettings
from mapquilt.merging.merge_folder import write_merge
from mapquilt.merging.merge_inputs import INPUTS, MergeInputs
from merge.multimap import verdicts
from merge.multimap.graph import Cluster
from merge.multimap.results import merge_result
from merge.multimap.team import Solution, Team
from merge.records.result import MergeResult
from merge.settings import MergeSettings


def record_merge(folder: Path, state: LiveState, settings: LiveSettings = LiveSettings()) -> tuple[Path, ...]:
    """Write the merge of a state into a folder, as ``mapquilt merge --out`` does; return the paths of the files.

    The reference is the robot that holds the merged frame. Raises ``ValueError`` if no map came.
    """
    inputs = _inputs(state)
    merge = dataclasses.replace(settings.merge, reference=_reference(state))
    return write_merge(folder, inputs, merge, settings.seed, merge_of_state(inputs.maps, state, merge, settings.seed))


def merge_of_state(maps: MapSet, state: LiveState, settings: MergeSettings, seed: int) -> MergeResult:
    """Return the result whose poses are those that are published; a map that is not joined is alone."""
    team = Team.of(maps, settings, seed)
    placed = {team.index(name): pose for name, pose in state.poses.items()}
    clusters = [_cluster(team, placed)] if placed else []
    clusters += [Cluster.of_one(index) for index in range(len(maps)) if index not in placed]
    answers = {}
    known = {team.pair(*names): entry.answer for names, entry in state.pairs.items()}
    for pair in team.pairs:
        joined = all(index in placed for index in pair) and pair in known
        answers[pair] = known[pair] if joined else verdicts.across_clusters(known.get(pair), team.task(pair))
    result = merge_result(team, Solution(tuple(sorted(clusters, key=lambda each: each.root)), answers))
    left_out = {name: state.placements[name].reason or reason for name, reason in result.left_out.items()}
    return dataclasses.replace(result, left_out=left_out)


def _cluster(team: Team, placed: dict[int, Similarity2]) -> Cluster:
    local = {index: pose @ team.frames[index].metres_from_local for index, pose in placed.items()}
    root = local[min(local)].inverse()
    return Cluster({index: root @ pose for index, pose in local.items()}, ())


def _reference(state: LiveState) -> str | None:
    return next((name for name, each in state.placements.items() if each.holds_frame), None)


def _inputs(state: LiveState) -> MergeInputs:
    """Return the last maps of all robots, and their files."""
    grids = {name: robot.grid for name, robot in state.robots.items() if robot.grid is not None}
    if not grids:
        raise ValueError("no usable map came, so there is nothing to record")
    maps = MapSet(tuple(grids), tuple(grids.values()), tuple("m" for _ in grids), provenance={"source": "live"})
    copies: dict[str, bytes] = {}
    for index, (name, grid) in enumerate(grids.items()):
        copies |= {str(path): data for path, data in map_files(grid, Path(INPUTS) / str(index) / name).items()}
    files = tuple(f"{INPUTS}/{index}/{name}.yaml" for index, name in enumerate(grids))
    return MergeInputs(maps, files, (None,) * len(grids), copies)
