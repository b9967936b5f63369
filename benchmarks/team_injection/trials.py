"""Trials on synthetic teams: rejection of wrong answers, and pose errors of joint refinement and chained pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from benchmarks.team_injection.drawn_team import DrawnSettings, DrawnTeam, draw_team
from benchmarks.team_injection.injection import inject
from mapping.geometry.similarity2 import Similarity2
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


def injection_trial(seed: int, share: float = 0.3, draws: int = 1, maps: int | None = None) -> InjectionTrial | None:
    """Cluster a team with injected wrong answers and count what is kept; None if its maps overlap too little."""
    world, team = drawn(seed, maps)
    injected = inject(team, share, np.random.default_rng([seed, 1]), draws)
    if injected is None:
        return None
    groups = _groups(team, injected.pairs)
    names = team.maps.names
    kept = {frozenset((names[e.target], names[e.source])) for group in groups for e in group.edges}
    wrong = {frozenset(pair) for pair in injected.wrong}
    right = {frozenset((p.target, p.source)) for p in injected.pairs} - wrong
    lost = len(names) - max(len(group.poses) for group in groups)
    return InjectionTrial(
        world, len(names), len(injected.pairs), len(wrong), len(wrong & kept), lost, len(right - kept)
    )


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
