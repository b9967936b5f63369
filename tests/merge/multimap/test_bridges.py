"""Bridges of large teams: a right alignment of two clusters fits all over, and the team itself shows how well."""

import math
from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.team_injection.drawn_team import DrawnSettings, DrawnTeam, draw_team
from benchmarks.team_scale import wrong_joins
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.geometry.similarity2_array import Similarity2Array
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.jobs.runner import Runner, Workers
from merge.merger import merge_maps
from merge.multimap.bridge import Bridge
from merge.multimap.bridge_fit import BridgeFit
from merge.multimap.bridges import BridgeSearch, join_bridges
from merge.multimap.graph import Cluster, Edge
from merge.multimap.misfit_odds import MisfitOdds
from merge.multimap.place_index import indexed_poses
from merge.multimap.team import Team
from merge.pair.pipeline import match
from merge.records.prior import Prior
from merge.retrieval.relative_poses import RelativePoses
from merge.settings import MergeSettings
from worlds.families.registry import make_world

START = MergeSettings()
SELECTION = replace(START.multimap.selection, min_indexed_maps=8)
INDEXED = replace(START, multimap=replace(START.multimap, selection=SELECTION))
"""Teams of eight maps are indexed already."""

CLEAR = MisfitOdds(np.linspace(0.8, 1.3, 50), np.linspace(8.0, 40.0, 300), 1000.0, -2.0)
"""Right alignments have misfits about 1, wrong ones 8 and more."""


@pytest.fixture(scope="module")
def drawn() -> DrawnTeam:
    settings = DrawnSettings(maps=10, reach=4.0, range=5.0)
    return draw_team(make_world("office", 7, 22.0, 16.0), settings, np.random.default_rng(2))


@pytest.fixture(scope="module")
def team(drawn: DrawnTeam) -> Team:
    return Team.of(drawn.maps, INDEXED)


def true_poses(drawn: DrawnTeam, team: Team) -> list[Similarity2]:
    """world_from_map of the maps in the order of the team, between metres."""
    return [drawn.world_from_map[drawn.maps.names.index(name)] for name in team.maps.names]


def halves(drawn: DrawnTeam, team: Team) -> tuple[Cluster, Cluster]:
    """Two clusters of five maps each, at their true poses in the local frame of the first map of each."""
    world = true_poses(drawn, team)
    local = [world[k] @ team.frames[k].metres_from_local for k in range(len(world))]
    order = sorted(range(10), key=lambda k: local[k].x)
    parts = sorted(order[:5]), sorted(order[5:])
    first, second = (Cluster({k: local[part[0]].inverse() @ local[k] for k in part}, ()) for part in sorted(parts))
    return first, second


def right_alignment(drawn: DrawnTeam, team: Team, first: Cluster, second: Cluster) -> Similarity2:
    world = true_poses(drawn, team)
    here, there = (world[k] @ team.frames[k].metres_from_local for k in (first.root, second.root))
    return here.inverse() @ there


def truth_between(drawn: DrawnTeam, team: Team, a: int, b: int) -> Similarity2:
    world = true_poses(drawn, team)
    return team.local(world[a].inverse() @ world[b], a, b)


def test_only_the_right_alignment_of_two_clusters_fits(drawn, team):
    first, second = halves(drawn, team)
    right = right_alignment(drawn, team, first, second)
    fit = BridgeFit(team, [first, second])
    between = first.root, second.root
    misfit = fit.fitted(Bridge(first, second, right, between)).misfit
    shifts = [Similarity2(30.0, 0.0), Similarity2(0.0, -30.0), Similarity2(yaw=0.5), Similarity2(25.0, 25.0, 3.0)]
    for shift in shifts:
        assert fit.fitted(Bridge(first, second, right @ shift, between)).misfit > 3.0 * misfit


@given(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-0.03, 0.03))
@settings(max_examples=10, deadline=None)
def test_refinement_leads_back_to_the_right_alignment(drawn, team, x, y, yaw):
    first, second = halves(drawn, team)
    right = right_alignment(drawn, team, first, second)
    fit = BridgeFit(team, [first, second])
    between = first.root, second.root
    at = first.poses[between[0]]
    moved = at @ Similarity2(x, y, yaw) @ at.inverse() @ right
    found = fit.refined(Bridge(first, second, moved, between)).target_from_source(*between)
    true = truth_between(drawn, team, *between)
    assert math.hypot(found.x - true.x, found.y - true.y) < 2.0
    assert abs(found.yaw - true.yaw) < 0.01


def corridor(niches: bool = True) -> MapSet:
    """Eight maps of 20 x 4 m, each 2 m further along a corridor of 34 m, bare or with two niches."""
    place = np.full((80, 720), -2.0, np.float32)
    place[:20], place[60:] = 2.0, 2.0
    if niches:
        place[12:20, 152:164] = place[12:20, 428:437] = -2.0
    free = cv2.dilate((place < 0.0).astype(np.uint8), np.ones((3, 3), np.uint8))
    place[free == 0] = 0.0
    frame = GridFrame(0.05, SE2.identity(), (80, 400))
    grids = tuple(OccupancyGrid(frame, np.ascontiguousarray(place[:, 40 * k : 40 * k + 400])) for k in range(8))
    return MapSet(tuple(f"map_{k}" for k in range(8)), grids, ("m",) * 8)


def corridor_parts(team: Team) -> tuple[Bridge, list[float]]:
    """The right alignment of the four maps at one end of the corridor and the others, and where each map starts [m]."""
    starts = [2.0 * int(name[4:]) for name in team.maps.names]
    local = [Similarity2(starts[k]) @ team.frames[k].metres_from_local for k in range(8)]

    def cluster(members) -> Cluster:
        root = local[min(members)].inverse()
        return Cluster({k: root @ local[k] for k in members}, ())

    parts = [[k for k in range(8) if (starts[k] < 8.0) == left] for left in (True, False)]
    first, second = sorted(map(cluster, parts), key=lambda each: each.root)
    pair = first.root, second.root
    return Bridge(first, second, local[pair[0]].inverse() @ local[pair[1]], pair), starts


@pytest.mark.parametrize("shift", [0.3, 0.6, 1.0])
def test_an_alignment_slides_along_a_corridor(shift):
    team = Team.of(corridor(), INDEXED)
    right, starts = corridor_parts(team)
    pair = right.between
    moved = Similarity2(starts[pair[0]]).inverse() @ Similarity2(starts[pair[1]] + shift)
    suggested = RelativePoses(np.array([pair[0]]), np.array([pair[1]]), Similarity2Array.of([moved]), np.ones(1))
    search = BridgeSearch(team, suggested, [right.first, right.second])

    def error(thorough: bool) -> float:
        (found,) = search.find({}, thorough)
        return 0.05 * abs(found.target_from_source(*pair).x - right.target_from_source(*pair).x)

    assert error(thorough=False) > 0.2
    assert error(thorough=True) < 0.1


@pytest.mark.parametrize("niches", [True, False])
def test_a_corridor_holds_an_alignment_only_by_its_niches(niches):
    team = Team.of(corridor(niches), INDEXED)
    right, _ = corridor_parts(team)
    fit = BridgeFit(team, [right.first, right.second])
    assert fit.holds(fit.measured(right)) == niches


def test_an_answer_that_slid_along_a_corridor_is_not_at_its_bridge():
    team = Team.of(corridor(), INDEXED)
    right, _ = corridor_parts(team)
    fit, (a, b) = BridgeFit(team, [right.first, right.second]), right.between
    for shift, near in ((0.0, True), (2.0, True), (10.0, False)):
        edge = edge_between(right.first, right.second, a, b, right.target_from_source(a, b) @ Similarity2(shift))
        assert fit.is_at(right, edge) == fit.is_at(right, edge.reversed()) == near


def test_an_answer_of_a_pair_suggests_an_alignment_too(drawn, team):
    first, second = halves(drawn, team)
    a, b = min(
        ((a, b) for a in first.poses for b in second.poses),
        key=lambda pair: np.hypot(*truth_between(drawn, team, *pair).matrix()[:, 2]),
    )
    pair = min(a, b), max(a, b)
    answer = match(team.task(pair))
    (found,) = BridgeSearch(team, RelativePoses.none(), [first, second]).find({pair: answer})
    true = truth_between(drawn, team, *found.between)
    assert math.hypot(*(found.target_from_source(*found.between).matrix() - true.matrix())[:, 2]) < 3.0
    assert found.misfit < 5.0


def test_odds_are_learned_from_the_clusters_themselves(drawn, team):
    """Pairs that joined fit, and places that look alike inside the clusters do not."""
    world = true_poses(drawn, team)
    local = [world[k] @ team.frames[k].metres_from_local for k in range(10)]
    poses = {k: local[0].inverse() @ local[k] for k in range(10)}
    inside = Cluster(poses, ())
    pairs = sorted(
        combinations(range(10), 2), key=lambda pair: np.hypot(*inside.target_from_source(*pair).matrix()[:, 2])
    )
    edges = tuple(edge_between(inside, inside, a, b, inside.target_from_source(a, b)) for a, b in pairs[:20])
    whole = Cluster(poses, edges)
    found = BridgeSearch(team, indexed_poses(team), [whole]).learn()
    assert np.median(found.right) < 2.0
    assert len(found.wrong) > 20
    assert np.quantile(found.wrong, 0.1) > np.quantile(found.right, 0.9)


def test_the_index_suggests_the_right_alignment_of_two_clusters(drawn, team):
    first, second = halves(drawn, team)
    best = BridgeSearch(team, indexed_poses(team), [first, second]).find({})[0]
    a, b = best.between
    found, true = best.target_from_source(a, b), truth_between(drawn, team, a, b)
    assert math.hypot(found.x - true.x, found.y - true.y) < 3.0
    assert best.pairs


def test_places_of_one_cluster_share_the_probability(drawn, team):
    first, second = halves(drawn, team)
    right, between = right_alignment(drawn, team, first, second), (first.root, second.root)
    search = BridgeSearch(team, RelativePoses.none(), [first, second])

    def likely(*alternatives) -> list[float]:
        """Misfits of those that are likely, of alignments that are (shift, misfit)."""
        bridges = [Bridge(first, second, right @ Similarity2(x), between, misfit, 2000.0) for x, misfit in alternatives]
        return [bridge.misfit for bridge, _ in search.likely(CLEAR, bridges)]

    assert likely((0.0, 1.0), (0.0, 20.0)) == [1.0]
    assert likely((60.0, 1.5), (0.0, 1.0)) == []
    assert likely((60.0, 12.0), (0.0, 1.0)) == [1.0]
    assert likely((2.0, 1.5), (0.0, 1.0)) == [1.0, 1.5]


def test_places_on_two_clusters_share_the_probability_unless_those_fit_one_another(drawn, team):
    world = true_poses(drawn, team)
    local = [world[k] @ team.frames[k].metres_from_local for k in range(10)]
    order = sorted(range(10), key=lambda k: local[k].x)
    parts = sorted(map(sorted, (order[4:6], [*order[:4:2], *order[6::2]], [*order[1:4:2], *order[7::2]])))
    clusters = [Cluster({k: local[part[0]].inverse() @ local[k] for k in part}, ()) for part in parts]
    small, *large = sorted(clusters, key=lambda each: len(each.poses))
    search = BridgeSearch(team, RelativePoses.none(), clusters)

    def number_likely(shift: float) -> int:
        bridges = []
        for other, x in zip(large, (0.0, shift), strict=True):
            place = local[other.root].inverse() @ local[small.root] @ Similarity2(x)
            bridges.append(Bridge(other, small, place, (other.root, small.root), 1.0, 2000.0))
        return len(search.likely(CLEAR, bridges))

    assert number_likely(0.0) == 2
    assert number_likely(40.0) == 0


def edge_between(first: Cluster, second: Cluster, a: int, b: int, local: Similarity2) -> Edge:
    assert a in first.poses
    assert b in second.poses
    return Edge(a, b, local, np.diag([1.0, 1.0, 1e-4, 1e-4]), 1.0)


def test_clusters_join_by_a_right_answer_only(drawn, team):
    first, second = halves(drawn, team)
    fit = BridgeFit(team, [first, second])
    true = truth_between(drawn, team, first.root, second.root)
    right = edge_between(first, second, first.root, second.root, true)
    wrong = edge_between(first, second, first.root, second.root, true @ Similarity2(25.0, 25.0, 3.0))
    assert len(join_bridges(team, fit, CLEAR, [first, second], [wrong])) == 2
    (joined,) = join_bridges(team, fit, CLEAR, [first, second], [wrong, right.reversed()])
    assert sorted(joined.poses) == list(range(10))
    assert [edge.pair for edge in joined.edges] == [right.pair]


def test_clusters_do_not_join_against_a_prior(drawn):
    def with_priors(shift: float) -> Team:
        names, world = drawn.maps.names, drawn.world_from_map
        priors = tuple(
            Prior(name, pose.x + shift * (k % 2), pose.y, pose.yaw, 0.5)
            for k, (name, pose) in enumerate(zip(names, world, strict=True))
        )
        return Team.of(drawn.maps, replace(INDEXED, priors=priors))

    for shift, groups in ((0.0, 1), (40.0, 2)):
        team = with_priors(shift)
        first, second = halves(drawn, team)
        fit = BridgeFit(team, [first, second])
        true = truth_between(drawn, team, first.root, second.root)
        edge = edge_between(first, second, first.root, second.root, true)
        assert len(join_bridges(team, fit, CLEAR, [first, second], [edge])) == groups


@pytest.mark.slow
def test_an_indexed_team_joins_right_with_any_workers_and_in_any_order(drawn):
    whole = merge_maps(drawn.maps, INDEXED)
    assert len(whole.reference_from_map) >= 9
    assert wrong_joins(drawn, whole) == []
    order = np.random.default_rng(1).permutation(10).tolist()
    maps = drawn.maps
    shuffled = MapSet(*(tuple(part[k] for k in order) for part in (maps.names, maps.grids, maps.units)))
    with Runner(Workers(2)) as runner:
        again = merge_maps(shuffled, INDEXED, runner=runner)
    assert set(again.reference_from_map) == set(whole.reference_from_map)
    start = again.reference_from_map[whole.reference].inverse()
    for name, pose in whole.reference_from_map.items():
        other = start @ again.reference_from_map[name]
        assert (other.x, other.y, other.yaw) == pytest.approx((pose.x, pose.y, pose.yaw), abs=1e-3)


def test_blank_maps_of_a_large_team_stay_apart():
    blank = OccupancyGrid(GridFrame(0.05, SE2.identity(), (40, 40)), np.full((40, 40), -1.0, np.float32))
    names = tuple(f"map_{k}" for k in range(9))
    result = merge_maps(MapSet(names, (blank,) * 9, ("m",) * 9), INDEXED)
    assert len(result.groups) == 9
