"""Trials on synthetic teams: rejection of wrong answers, and pose errors of joint refinement and chained pairs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from benchmarks.team_injection.drawn_team import DrawnSettings, DrawnTeam, draw_team
from benchmarks.team_injection.injection import inject
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.literature.motion_averaging import MotionAveraging, RelativeMotion
from merge.merger import merge_maps
from merge.multimap.clustering import cluster_maps
from merge.multimap.graph import Cluster, ConsistencyModel, edge_from_answer
from merge.multimap.overlap_likelihood import OverlapLikelihood
from merge.multimap.team import local_frames
from merge.pair.feature_cache import FeatureCache
from merge.records.result import MergeResult, PairResult
from worlds.families.registry import make_world

WORLDS = ("office", "house", "hospital", "maze", "cave", "thesis_floor", "warehouse")
SIZES = {"house": (24.0, 18.0), "thesis_floor": (None, None)}
USUAL = (40.0, 28.0)
COARSE_TEAMS = DrawnSettings(stops=15, beams=240, drift=0.02, turn_drift=0.004, resolution=0.1)


@dataclass(frozen=True)
class InjectionTrial:
    """Counts of one team: maps, answers, wrong ones, wrong ones kept, maps lost, and right answers rejected."""

    world: str
    maps: int
    edges: int
    wrong: int
    wrong_kept: int
    maps_lost: int
    right_rejected: int

    @property
    def passed(self) -> bool:
        return self.wrong_kept == 0 and self.maps_lost == 0


def drawn(seed: int, maps: int | None = None, settings: DrawnSettings = COARSE_TEAMS) -> tuple[str, DrawnTeam]:
    """Draw the team of a seed, and name its world: 3 to 20 maps by default, every other team with unknown scales."""
    rng = np.random.default_rng(seed)
    number = int(rng.integers(3, 21)) if maps is None else maps
    world = WORLDS[seed % len(WORLDS)]
    low, high = ((1.0, 1.0), (0.6, 1.6))[seed % 2]
    chosen = DrawnSettings(**{**vars(settings), "maps": number, "scale_low": low, "scale_high": high})
    return world, draw_team(make_world(world, seed, *SIZES.get(world, USUAL)), chosen, rng)


Kept = tuple[set[frozenset[str]], int]
"""Pairs of names whose answers a method kept, and the number of maps of its largest group."""


def injection_trial(
    seed: int,
    share: float = 0.3,
    draws: int = 1,
    maps: int | None = None,
    keep: Callable[[DrawnTeam, Sequence[PairResult]], Kept] | None = None,
) -> InjectionTrial | None:
    """Let a method choose among the answers of a team, wrong ones injected, and count what it keeps.

    ``keep`` is the clustering of the merger, unless given. Returns None if the maps of the team overlap too little.
    """
    world, team = drawn(seed, maps)
    injected = inject(team, share, np.random.default_rng([seed, 1]), draws)
    if injected is None:
        return None
    kept, joined = (keep or clustered)(team, injected.pairs)
    wrong = {frozenset(pair) for pair in injected.wrong}
    right = {frozenset((p.target, p.source)) for p in injected.pairs} - wrong
    return InjectionTrial(
        world=world,
        maps=len(team.maps),
        edges=len(injected.pairs),
        wrong=len(wrong),
        wrong_kept=len(wrong & kept),
        maps_lost=len(team.maps) - joined,
        right_rejected=len(right - kept),
    )


def clustered(team: DrawnTeam, pairs: Sequence[PairResult]) -> Kept:
    """Choose as the merger does, which also looks at the cells of the maps."""
    groups, names = _groups(team, pairs), team.maps.names
    kept = {frozenset((names[e.target], names[e.source])) for group in groups for e in group.edges}
    return kept, max(len(group.poses) for group in groups)


def averaged(team: DrawnTeam, pairs: Sequence[PairResult]) -> Kept:
    """Choose by robust motion averaging, from the transforms alone."""
    index = team.maps.names.index
    motions = [
        RelativeMotion(index(pair.target), index(pair.source), pair.target_from_source)
        for pair in pairs
        if pair.target_from_source is not None
    ]
    corners = [_corners(grid) for grid in team.maps.grids]
    found = MotionAveraging().average(motions, corners, np.random.default_rng(0))
    kept = {frozenset((pair.target, pair.source)) for pair, good in zip(pairs, found.kept, strict=True) if good}
    return kept, sum(pose is not None for pose in found.reference_from_map)


def _corners(grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return the corners (4, 2) of the box of a map's known cells [m]."""
    cells = np.argwhere(grid.known)
    (low_row, low_col), (high_row, high_col) = cells.min(axis=0), cells.max(axis=0)
    box = [(low_row, low_col), (low_row, high_col), (high_row, low_col), (high_row, high_col)]
    return grid.frame.metres_from_cells(np.array(box))


def _groups(team: DrawnTeam, pairs: Sequence[PairResult]) -> list[Cluster]:
    cache = FeatureCache()
    frames = local_frames(team.maps, cache)
    index = team.maps.names.index
    edges = [edge_from_answer(pair, (index(pair.target), index(pair.source)), frames) for pair in pairs]
    likelihood = OverlapLikelihood(team.maps, frames, cache)
    return cluster_maps(len(team.maps), edges, ConsistencyModel(likelihood, team.maps.resolutions_trusted))


@dataclass(frozen=True)
class PoseTrial:
    """Errors of the maps of one team relative to the reference: see ``pose_errors``."""

    joint: tuple[float, ...]
    chained: tuple[float, ...]


def pose_trial(seed: int, maps: int = 8) -> PoseTrial | None:
    """Merge a team, and measure the errors of joint poses and of chained pairs; None if fewer than three maps join."""
    _, team = drawn(seed, maps=maps)
    result = merge_maps(team.maps)
    if len(result.reference_from_map) < 3:
        return None
    joint = pose_errors(team, dict(result.reference_from_map))
    return PoseTrial(tuple(joint), tuple(pose_errors(team, chained(team, result))))


def pose_errors(team: DrawnTeam, reference_from_map: dict[str, Similarity2]) -> list[float]:
    """Return the mean displacement of the known cells of each map but the reference [its cells]."""
    names = team.maps.names
    reference = next(name for name, place in reference_from_map.items() if place == Similarity2.identity())
    errors = []
    for name, place in reference_from_map.items():
        if name != reference:
            grid = team.maps.grids[names.index(name)]
            truth = team.truth(names.index(reference), names.index(name))
            points = grid.frame.metres_from_cells(np.argwhere(grid.known))
            off = np.hypot(*(place.apply(points) - truth.apply(points)).T).mean()
            errors.append(float(off / (truth.scale * grid.frame.resolution)))
    return errors


def chained(team: DrawnTeam, result: MergeResult) -> dict[str, Similarity2]:
    """Chain the pairs of the first group along a maximum spanning tree by confidence."""
    names = [name for name in team.maps.names if name in result.reference_from_map]
    held = [p for p in result.pairs if p.accepted and p.target in names and p.source in names]
    at = {name: k for k, name in enumerate(names)}
    costs = [2.0 - p.confidence for p in held]
    ends = [at[p.target] for p in held], [at[p.source] for p in held]
    tree = minimum_spanning_tree(csr_array((costs, ends), shape=(len(names), len(names))))
    order, before = breadth_first_order(tree, at[result.reference], directed=False)
    between: dict[tuple[int, int], Similarity2] = {}
    for pair in held:
        found = pair.target_from_source
        if found is not None:
            between[at[pair.target], at[pair.source]] = found
            between[at[pair.source], at[pair.target]] = found.inverse()
    placed = {at[result.reference]: Similarity2.identity()}
    for k in order.tolist()[1:]:
        placed[k] = placed[int(before[k])] @ between[int(before[k]), k]
    return {names[k]: place for k, place in placed.items()}
