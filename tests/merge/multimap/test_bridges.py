"""Bridges of large teams: a right alignment of two clusters fits all over, and the team itself shows how well."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.team_injection.drawn_team import DrawnSettings, DrawnTeam, draw_team
from benchmarks.team_scale import wrong_joins
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.jobs.runner import Runner, Workers
from merge.merger import merge_maps
from merge.multimap.bridges import LEAST_JOINED, Bridge, BridgeSearch, FitOdds
from merge.multimap.graph import Cluster
from merge.multimap.place_index import indexed_poses
from merge.multimap.team import Team
from merge.settings import MergeSettings
from worlds.families.registry import make_world

FITS = st.lists(st.floats(0.0, 1.0), min_size=LEAST_JOINED, max_size=60)
START = MergeSettings()
SELECTION = replace(START.multimap.selection, min_indexed_maps=8)
INDEXED = replace(START, multimap=replace(START.multimap, selection=SELECTION))
"""Teams of eight maps are indexed already."""


@pytest.fixture(scope="module")
def drawn() -> DrawnTeam:
    settings = DrawnSettings(maps=10, reach=4.0, range=5.0)
    return draw_team(make_world("office", 7, 22.0, 16.0), settings, np.random.default_rng(2))


@pytest.fixture(scope="module")
def team(drawn: DrawnTeam) -> Team:
    return Team.of(drawn.maps, INDEXED)


def odds(right, wrong) -> FitOdds:
    return FitOdds(None, np.sort(right), np.sort(wrong))  # type: ignore[arg-type]


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


@given(FITS, FITS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_better_fit_never_lowers_the_odds(right, wrong, one, other):
    low, high = sorted((one, other))
    assert odds(right, wrong).log_odds(low) <= odds(right, wrong).log_odds(high)


@given(FITS, FITS, st.floats(0.0, 1.0))
def test_no_fit_is_surer_than_the_samples_allow(right, wrong, fit):
    found = odds(right, wrong).log_odds(fit)
    assert -math.log(len(right) + 1) <= found <= math.log(len(wrong) + 1)


def test_few_joined_pairs_say_nothing():
    assert odds([0.9] * (LEAST_JOINED - 1), [0.1] * 50).log_odds(0.95) == 0.0


def test_separate_samples_are_told_apart():
    found = odds(np.linspace(0.9, 1.0, 50), np.linspace(0.3, 0.8, 200))
    assert found.log_odds(0.95) > 4.0
    assert found.log_odds(0.6) < -3.0


def test_the_right_alignment_of_two_clusters_fits_better_than_shifted_ones(drawn, team):
    first, second = halves(drawn, team)
    world = true_poses(drawn, team)
    roots = [world[k] @ team.frames[k].metres_from_local for k in (first.root, second.root)]
    right = roots[0].inverse() @ roots[1]
    search = BridgeSearch(team, indexed_poses(team))
    between = first.root, second.root
    fit = search.measured(Bridge(first, second, right, between)).fit
    shifts = [Similarity2(30.0, 0.0), Similarity2(0.0, -30.0), Similarity2(yaw=0.5), Similarity2(25.0, 25.0, 3.0)]
    for shift in shifts:
        assert search.measured(Bridge(first, second, right @ shift, between)).fit < fit - 0.1
    assert fit > 0.8


def test_the_index_suggests_the_right_alignment_of_two_clusters(drawn, team):
    first, second = halves(drawn, team)
    search = BridgeSearch(team, indexed_poses(team))
    best = search.find([first, second])[0]
    a, b = best.pairs[0]
    a, b = (a, b) if a in best.first.poses else (b, a)
    local = best.first.poses[a].inverse() @ best.first_from_second @ best.second.poses[b]
    found = team.frames[a].metres_from_local @ local @ team.frames[b].metres_from_local.inverse()
    world = true_poses(drawn, team)
    true = world[a].inverse() @ world[b]
    assert math.hypot(found.x - true.x, found.y - true.y) < 0.5
    assert search.select([best], set(best.pairs)) == sorted(best.pairs[: SELECTION.bridge_pairs])
    assert search.select([best], set()) == []


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
        assert (other.x, other.y, other.yaw) == pytest.approx((pose.x, pose.y, pose.yaw), abs=1e-4)


def test_blank_maps_of_a_large_team_stay_apart():
    blank = OccupancyGrid(GridFrame(0.05, SE2.identity(), (40, 40)), np.full((40, 40), -1.0, np.float32))
    names = tuple(f"map_{k}" for k in range(9))
    result = merge_maps(MapSet(names, (blank,) * 9, ("m",) * 9), INDEXED)
    assert len(result.groups) == 9
