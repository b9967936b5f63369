"""The measures of the scale benchmark, by known answers."""

import dataclasses

import numpy as np

from benchmarks.team_injection.drawn_team import DrawnTeam
from benchmarks.team_scale import overlaps, recall, wrong_joins
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.records.result import MergeResult, PairResult


def team_of(places):
    """Maps of 2 x 2 m without walls, whose corners lie at these places."""
    frame = GridFrame(0.1, SE2.identity(), (20, 20))
    grid = OccupancyGrid(frame, np.full((20, 20), -1.0, np.float32))
    names = tuple("abcdef"[: len(places)])
    maps = MapSet(names, (grid,) * len(places), ("m",) * len(places), True)
    return DrawnTeam(maps, tuple(Similarity2(*place) for place in places))


def test_overlap_is_the_share_of_the_smaller_map():
    shares = overlaps(team_of([(0.0, 0.0), (1.0, 0.0), (0.0, 9.0), (1.0, 1.0)]))
    np.testing.assert_allclose(
        shares, [[0.0, 0.5, 0.0, 0.25], [0.5, 0.0, 0.0, 0.5], [0.0] * 4, [0.25, 0.5, 0.0, 0.0]], atol=0.06
    )


def test_recall_counts_maps_whose_best_hold_a_neighbour():
    overlap = np.zeros((8, 8))
    overlap[0, 1] = overlap[1, 0] = overlap[2, 3] = overlap[3, 2] = 0.5
    overlap[4, 5] = overlap[5, 4] = 0.1  # too little to be a neighbour
    scores = np.zeros((8, 8))
    scores[0, 1] = scores[3, 2] = scores[1, 0] = 1.0
    scores[2] = [1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]
    assert recall(scores, overlap) == 0.75


def test_a_join_is_wrong_from_a_metre_on():
    team = team_of([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])

    def answer(target, source, found, accepted=True):
        return PairResult(target, source, accepted, 0.9, None, found, None, "m", None)

    pairs = (
        answer("a", "b", Similarity2(1.9, 0.0)),
        answer("b", "c", Similarity2(-1.0, 2.1)),
        answer("a", "c", Similarity2(9.0, 0.0), accepted=False),
    )
    result = MergeResult(team.maps.names, pairs, (), {}, True)
    assert wrong_joins(team, result) == [pairs[1]]
    right = dataclasses.replace(result, pairs=pairs[:1])
    assert wrong_joins(team, right) == []
