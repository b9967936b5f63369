"""The entry points of the merger."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

from mapping.geometry.similarity2 import Similarity2
from mapping.map_set import MapSet
from merge.multimap import verdicts
from merge.multimap.bridge import Bridge
from merge.multimap.bridge_fit import BridgeFit
from merge.multimap.bridges import BridgeSearch, join_bridges
from merge.multimap.cluster_merging import FusedMatch, match_fused_clusters
from merge.multimap.clustering import cluster_maps
from merge.multimap.graph import Cluster, ClusterAlignment, Edge, Pair, in_matching_order, pairs_of, placed_together
from merge.multimap.joint_icp import joint_icp
from merge.multimap.misfit_odds import LEAST_JOINED
from merge.multimap.pair_selection import Ranking, nearest_partners, rank_pairs, select
from merge.multimap.pose_graph import join_clusters, refit_cluster
from merge.multimap.results import merge_result
from merge.multimap.stitching import stitch
from merge.multimap.team import Answers, Solution, Team
from merge.pair.feature_cache import FeatureCache
from merge.pair.pipeline import GuidedTask, match, match_near
from merge.pair.task import PairTask, Runner, run_tasks
from merge.records.result import MergeResult, PairResult
from merge.records.verdict import Reason
from merge.retrieval.relative_poses import RelativePoses
from merge.settings import MergeSettings

Progress = Callable[[int, int], None]
"""Called with the number of pairs done and the number of pairs."""


def merge_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),
    seed: int = 0,
    on_progress: Progress | None = None,
    runner: Runner | None = None,
    answers: Mapping[tuple[str, str], PairResult] | None = None,
) -> MergeResult:
    """Find the transforms between the maps of a team, accept or refuse each, and fuse the maps that join.

    ``settings.method`` proposes transforms; verification, refinement and acceptance are common to all methods. Of a
    large team the best pairs are matched until all maps are joined. Answers that contradict the others are refused,
    pairs that the others predict are matched again, and the poses and scales of a cluster are refined together on the
    cells. Each cluster is fused in the frame of one map.

    The same maps, settings and seed give the same result with any number of workers of the ``runner``, and in any order
    of the maps, except for its frame: that of the first map given of each cluster, unless the settings name one. Maps
    that do not match are no error: their pair is refused with a reason. ``answers``, by target and source, are those of
    pairs that were matched before. With ``settings.trust_priors`` the maps are stitched at their start poses instead,
    and nothing is matched.

    Raises ``ValueError`` if the seed is negative, a setting names an unknown map, or a map to stitch has no resolution.
    """
    _check_names(maps, settings)
    team = Team.of(maps, settings, seed, on_progress, runner)
    known = {team.pair(*names): answer for names, answer in (answers or {}).items() if set(names) <= set(maps.names)}
    solution = stitch(team) if settings.trust_priors else solve(team, known)
    result = merge_result(team, solution)
    team.forget_features()
    return result


def match_maps(
    maps: MapSet,
    settings: MergeSettings = MergeSettings(),
    seed: int = 0,
    on_progress: Progress | None = None,
) -> tuple[PairResult, ...]:
    """Match every pair by itself: answers of other pairs change nothing, and no maps are fused."""
    scale = settings.scale if settings.scale is not None else maps.scale_range
    tasks = [PairTask.of(maps, a, b, scale, settings, seed) for a, b in combinations(range(len(maps)), 2)]
    cache = FeatureCache(settings.preparation, kept=max(2, math.isqrt(2 * len(tasks)) + 2))
    done = iter(range(1, len(tasks) + 1))

    def step() -> None:
        if on_progress is not None:
            on_progress(next(done), len(tasks))

    return tuple(run_tasks(match, tasks, cache, None, step))


def _check_names(maps: MapSet, settings: MergeSettings) -> None:
    named = [("reference", settings.reference)] if settings.reference is not None else []
    for option, name in [*named, *(("prior", prior.name) for prior in settings.priors)]:
        if name not in maps.names:
            raise ValueError(f"{option} is {name!r}, must be the name of a map: {', '.join(maps.names)}")


def solve(team: Team, known: Answers) -> Solution:
    """Match the pairs of a team, cluster the maps, and refine each cluster; ``known`` pairs are not matched again."""
    ranking = rank_pairs(team, known)
    answers = match_pairs(team, known, select(team, ranking, known))
    clusters = cluster(team, answers)
    if ranking is not None and ranking.poses is not None and sum(len(each.edges) for each in clusters) >= LEAST_JOINED:
        clusters, answers = bridge_clusters(team, ranking.poses, answers, clusters)
    else:
        clusters, answers = match_across(team, ranking, answers, clusters)
    refined = []
    for each in clusters:
        each, answers = refine_cluster(team, answers, each)
        refined.append(each)
    solution = merge_clusters(team, Solution(tuple(refined), answers))
    return Solution(solution.clusters, _complete(team, solution))


def match_across(
    team: Team, ranking: Ranking | None, answers: Answers, clusters: list[Cluster]
) -> tuple[list[Cluster], Answers]:
    """Match the best pairs between clusters, and cluster the maps again, for some rounds."""
    for _ in range(team.settings.multimap.selection.rounds - 1):
        selected = select(team, ranking, answers, clusters)
        if not selected:
            break
        answers = match_pairs(team, answers, selected)
        clusters = cluster(team, answers)
    return clusters, answers


def bridge_clusters(
    team: Team, poses: RelativePoses, answers: Answers, clusters: list[Cluster]
) -> tuple[list[Cluster], Answers]:
    """Join the clusters of a large team, round by round, by alignments whose walls all fit."""
    for _ in range(team.settings.multimap.selection.indexed_rounds):
        clusters, answers = strengthen_clusters(team, answers, clusters)
        if len(clusters) == 1:
            break
        before = len(clusters)
        clusters, answers = join_likely(team, BridgeSearch(team, poses, clusters), answers, clusters)
        if len(clusters) == before:
            break
    return clusters, answers


def join_likely(
    team: Team, search: BridgeSearch, answers: Answers, clusters: list[Cluster]
) -> tuple[list[Cluster], Answers]:
    """Join clusters by their likely alignments; if those join none, by those of a thorough search."""
    odds, joined = search.learn(), clusters
    for thorough in (False, True):
        bridges = search.likely(odds, search.find(answers, thorough))
        edges, answers = match_bridges(team, search.fit, answers, bridges)
        joined = join_bridges(team, search.fit, odds, clusters, edges)
        if len(joined) < len(clusters):
            break
    return joined, answers


def match_bridges(
    team: Team, fit: BridgeFit, answers: Answers, bridges: Sequence[tuple[Bridge, float]]
) -> tuple[list[Edge], Answers]:
    """Match the pairs with most in common of each bridge where it puts them; each bridge comes with its confidence.

    A pair that shows only parallel walls counts if the walls of all maps that meet hold the bridge. Return the edges
    that agree with their bridges, in the order of those, and the answers.
    """
    most = team.settings.multimap.selection.bridge_pairs
    wanted: dict[Pair, tuple[Bridge, float]] = {}
    for bridge, confidence in bridges:
        for pair in bridge.pairs[:most]:
            wanted.setdefault(pair, (bridge, confidence))
    placed = [bridge.placed for bridge, _ in wanted.values()]
    tasks = [GuidedTask(team.task(p), team.metric(c, *team.task(p).names)) for p, c in zip(wanted, placed, strict=True)]
    accepted: dict[Pair, PairResult] = {}
    found = list(zip(wanted.items(), placed, team.run(match_near, tasks), strict=True))
    corridors = {bridge for (_, (bridge, _)), _, guided in found if guided.reason is Reason.PARALLEL_WALLS}
    held = {bridge for bridge in corridors if fit.holds(bridge)}
    for (pair, (bridge, confidence)), place, guided in found:
        agrees = guided.target_from_source is not None and team.agrees(guided, place)
        if bridge in held and guided.reason is Reason.PARALLEL_WALLS:
            agrees = agrees and fit.is_at(bridge, team.edge(guided))
            answer = verdicts.with_agreeing_refusals(answers.get(pair), guided, agrees, confidence)
        else:
            answer = verdicts.with_guided_answer(answers.get(pair), guided, agrees, confidence)
        if answer is not None:
            accepted[pair] = answer
    return [team.edge(answer) for answer in accepted.values()], {**answers, **accepted}


def strengthen_clusters(team: Team, answers: Answers, clusters: Sequence[Cluster]) -> tuple[list[Cluster], Answers]:
    """Match the pairs that clusters predict, and refine the poses of each on the cells."""
    found = []
    for each in clusters:
        if len(each.poses) > 1:
            each, accepted, _ = match_predicted_pairs(team, answers, each)
            answers = {**answers, **accepted}
            each = refine_poses(team, answers, each)
        found.append(each)
    return found, answers


def match_pairs(team: Team, answers: Answers, pairs: Sequence[Pair]) -> Answers:
    """Match pairs; match pairs that were refused or contradict a prior again near the prior."""
    pairs = in_matching_order(pairs)
    found = dict(zip(pairs, team.run(match, [team.task(pair) for pair in pairs]), strict=True))
    expected = {pair: team.expected[names] for pair in pairs if (names := team.task(pair).names) in team.expected}
    again = [pair for pair, where in expected.items() if verdicts.needs_prior_search(found[pair], where)]
    tasks = [GuidedTask(team.task(pair), expected[pair], _candidates(found[pair])) for pair in again]
    for pair, near in zip(again, team.run(match_near, tasks), strict=True):
        found[pair] = verdicts.with_prior(found[pair], near, expected[pair])
    found |= {pair: verdicts.within_prior(found[pair], where) for pair, where in expected.items()}
    return {**answers, **found}


def _candidates(answer: PairResult) -> tuple[Similarity2, ...]:
    """List all transforms that a pair found, the best first."""
    best = () if answer.target_from_source is None else (answer.target_from_source,)
    return (*best, *(other.target_from_source for other in answer.alternatives))


def cluster(team: Team, answers: Answers) -> list[Cluster]:
    """Cluster the maps by the accepted answers that agree with one another and with the cells.

    Of an indexed team only by sure ones; which of the others are right its clusters show.
    """
    edges = team.edges(answers)
    if team.indexed:
        least = team.settings.multimap.clustering.sure_log_odds - team.prior_log_odds
        edges = [edge for edge in edges if edge.log_odds >= least]
    return cluster_maps(len(team.maps), edges, team.model)


def refine_cluster(team: Team, answers: Answers, cluster: Cluster) -> tuple[Cluster, Answers]:
    """Add the pairs that a cluster predicts, refine its poses, and give all its pairs a verdict."""
    if len(cluster.poses) == 1:
        return cluster, answers
    joined = pairs_of(cluster.edges)
    cluster, accepted, overlapping = match_predicted_pairs(team, answers, cluster)
    others = (pair for pair in combinations(sorted(cluster.poses), 2) if pair not in joined and pair not in accepted)
    outside = {pair: verdicts.outside_graph(answers.get(pair), team.task(pair), pair in overlapping) for pair in others}
    answers = {**answers, **accepted, **outside}
    return refine_poses(team, answers, cluster), answers


def refine_poses(team: Team, answers: Answers, cluster: Cluster) -> Cluster:
    """Refine the poses of a cluster together on the cells of all pairs that join it.

    The tolerances of the pairs count, but not in an indexed team: its cells are wider than those of its pairs.
    """
    known = {} if team.indexed else answers
    tolerances = {
        pair: answer.evidence.tolerance_cells
        for pair, answer in known.items()
        if answer.evidence is not None and answer.accepted
    }
    settings = team.settings.multimap.joint_icp
    return joint_icp(cluster, team.likelihood.prepared, tolerances, team.scale.fixed, settings, team.settings.alignment)


def match_predicted_pairs(team: Team, answers: Answers, cluster: Cluster) -> tuple[Cluster, Answers, set[Pair]]:
    """Match the other pairs of a cluster again near its poses, and refit it on those that agree.

    Return the cluster, the answers that agree, and all pairs that it predicts to overlap.
    """
    joined = {edge.pair for edge in cluster.edges}
    least = team.settings.multimap.clustering.guided_log_odds
    ordered = {index: cluster.poses[index] for index in sorted(cluster.poses)}
    near = [
        (a, b)
        for a, b in team.model.neighbours(ordered, ordered)
        if a < b and (a, b) not in joined and team.likelihood(a, b, cluster.target_from_source(a, b)) >= least
    ]
    overlapping = set(near)
    if team.indexed:
        near = nearest_partners(team, cluster, near)
    accepted: dict[Pair, PairResult] = {}
    bridges = team.chain_confidences(cluster, answers)
    for pair, guided in zip(near, _match_where_predicted(team, cluster, near), strict=True):
        agrees = guided.accepted and team.agrees(guided, cluster)
        answer = verdicts.with_guided_answer(answers.get(pair), guided, agrees, bridges[pair])
        if answer is not None:
            accepted[pair] = answer
    if accepted:
        edges = [*cluster.edges, *(team.edge(answer) for answer in accepted.values())]
        cluster = refit_cluster(Cluster(cluster.poses, tuple(edges)), edges, team.model)
    return cluster, accepted, overlapping


def merge_clusters(team: Team, solution: Solution) -> Solution:
    """Merge clusters that refused answers and the match of their fused maps join, the largest first."""
    clusters, answers = list(solution.clusters), solution.answers
    tried: set[tuple[frozenset[int], frozenset[int]]] = set()
    while True:
        by_size = sorted(clusters, key=lambda each: (-len(each.poses), each.root))
        for first, second in combinations(by_size, 2):
            key = frozenset(first.poses), frozenset(second.poses)
            if len(first.poses) == 1 or key in tried:
                continue
            tried.add(key)
            found = match_fused_clusters(team, answers, first, second)
            both = None if found is None else _merge(team, answers, first, second, found)
            if both is not None:
                merged, answers = refine_cluster(team, both[1], both[0])
                clusters = [*(each for each in clusters if each not in (first, second)), merged]
                break
        else:
            return Solution(tuple(sorted(clusters, key=lambda each: each.root)), answers)


def _merge(
    team: Team, answers: Answers, first: Cluster, second: Cluster, found: FusedMatch
) -> tuple[Cluster, Answers] | None:
    """Join two clusters on the refused pairs that agree with the match of their fused maps; None if none does."""
    both = placed_together(first, second, found.first_from_second)
    links = [*team.chain_confidences(first, answers).values(), *team.chain_confidences(second, answers).values()]
    confidence = min([found.confidence, *links])
    accepted: dict[Pair, PairResult] = {}
    for pair, guided in zip(found.pairs, _match_where_predicted(team, both, found.pairs), strict=True):
        agrees = guided.target_from_source is not None and team.agrees(guided, both)
        answer = verdicts.with_agreeing_refusals(answers[pair], guided, agrees, confidence)
        if answer is not None:
            accepted[pair] = answer
    if not accepted:
        return None
    edges = tuple(team.edge(answer) for answer in accepted.values())
    alignment = ClusterAlignment(found.first_from_second, edges, 0.0)
    return join_clusters(first, second, alignment, team.model), {**answers, **accepted}


def _match_where_predicted(team: Team, cluster: Cluster, pairs: Sequence[Pair]) -> list[PairResult]:
    tasks = [team.task(pair) for pair in pairs]
    return team.run(match_near, [GuidedTask(task, team.metric(cluster, *task.names)) for task in tasks])


def _complete(team: Team, solution: Solution) -> Answers:
    """Give every pair its final verdict."""
    root_of = {index: each.root for each in solution.clusters for index in each.poses}
    answers = dict(solution.answers)
    for pair in team.pairs:
        if pair not in answers or root_of[pair[0]] != root_of[pair[1]]:
            answers[pair] = verdicts.across_clusters(answers.get(pair), team.task(pair))
    return answers
