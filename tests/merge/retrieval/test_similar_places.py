"""Wall patches do not depend on a map's own frame, and find the maps that show the same place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from benchmarks.team_injection.drawn_team import DrawnSettings, draw_team
from benchmarks.team_scale import index_scores, overlaps, recall
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.pair.feature_cache import metres_from_prepared, prepare_map
from merge.retrieval.settings import PatchSettings, RetrievalSettings
from merge.retrieval.similar_places import suggest_poses
from merge.retrieval.wall_patches import describe_walls
from tests.merge.rooms import CELL, observed, random_similarity, rooms, viewpoints
from worlds.families.registry import make_world

DENSE = PatchSettings(spacing=CELL, most=10**6)
"""A patch at every wall point, so that the squares of another frame choose no others."""

SAME, SPARSE = Similarity2.identity(), PatchSettings()

PADDING = st.tuples(*[st.tuples(st.integers(0, 40), st.integers(0, 40))] * 2)


def place(seed, part=0, frame=SAME):
    """One of the maps of a place, each from other viewpoints."""
    world, rng = rooms(np.random.default_rng(seed), 10.0, 8.0), np.random.default_rng((seed, part))
    return observed(world, viewpoints(world, rng, (0.5, 0.5), (9.5, 7.5), 15), frame, rng)


def place_scores(maps):
    return suggest_poses(maps, RetrievalSettings()).best_scores(len(maps))


def described(grid, patches=SPARSE):
    prepared = prepare_map(grid)
    return describe_walls(prepared, metres_from_prepared(grid.frame, prepared), patches)


def moved(grid, turns, pad):
    """Turn a map by quarters, and put unknown cells before and behind its own."""
    cells = np.pad(np.rot90(grid.log_odds, turns), pad)
    return OccupancyGrid(GridFrame(CELL, SE2.identity(), cells.shape), np.ascontiguousarray(cells))


@given(st.integers(0, 50), st.integers(0, 3), PADDING)
@settings(max_examples=10, deadline=None)
def test_patches_depend_on_neither_rotation_nor_origin(seed, turns, pad):
    grid = place(seed)
    before, after = described(grid, DENSE), described(moved(grid, turns, pad), DENSE)
    apart, match = cKDTree(after.waves).query(before.waves)
    assert len(before.points) == len(after.points)
    assert apart.max() < 0.002 * np.linalg.norm(before.waves, axis=1).mean()
    # np.rot90 turns rows of a raster whose row 0 is lowest clockwise.
    turned = before.points @ np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), turns)
    shifts = after.points[match] - turned
    assert np.mean(np.abs(shifts - np.median(shifts, axis=0)).max(axis=1) < 1e-6) > 0.95


@given(st.integers(0, 50))
@settings(max_examples=5, deadline=None)
def test_a_place_is_found_among_others_in_any_frame(seed):
    rng = np.random.default_rng(seed)
    maps = [place(seed + k // 2, k, random_similarity(rng)) for k in range(12)]
    scores = place_scores([described(grid) for grid in maps]).toarray()
    assert np.argmax(scores, axis=1).tolist() == [k ^ 1 for k in range(12)]


def test_scores_are_symmetric_and_the_same_in_every_run_and_order():
    maps = [described(place(k // 2, k)) for k in range(6)]
    scores = place_scores(maps).toarray()
    np.testing.assert_array_equal(scores, scores.T)
    assert scores.tobytes() == place_scores(maps).toarray().tobytes()
    order = np.random.default_rng(0).permutation(6)
    shuffled = place_scores([maps[k] for k in order]).toarray()
    # Votes are counted in bins of the frame of the map that comes first.
    np.testing.assert_allclose(shuffled, scores[np.ix_(order, order)], rtol=0.1)


def test_maps_without_walls_score_nothing():
    empty = OccupancyGrid(GridFrame(CELL, SE2.identity(), (40, 40)), np.full((40, 40), -1.0, np.float32))
    assert place_scores([described(empty)] * 2).toarray().tolist() == [[0.0, 0.0], [0.0, 0.0]]
    scores = place_scores([described(empty), described(place(0)), described(place(0, 1))]).toarray()
    assert scores[1, 2] > 0.0 == scores[0].max()


@pytest.mark.slow
def test_the_index_recalls_the_neighbours_of_a_small_team():
    team = draw_team(
        make_world("office", 7, 40.0, 28.0), DrawnSettings(maps=16, reach=7.0, range=6.5), np.random.default_rng(0)
    )
    assert recall(index_scores(team.maps.grids), overlaps(team)) > 0.9
