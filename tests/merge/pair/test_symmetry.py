"""Places that look the same turned by 180 degrees."""

import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.alignment.settings import AlignmentSettings
from merge.merger import match_maps
from merge.pair.feature_cache import FeatureCache, prepare_map
from merge.pair.pipeline import GuidedTask, match_near
from merge.pair.settings import SymmetrySettings
from merge.pair.symmetry import HalfTurns
from merge.pair.task import PairTask
from merge.records.verdict import Reason
from merge.settings import MergeSettings

ROWS, COLS, CELL = 240, 480, 0.05
SOUTH, NORTH = slice(0, 180), slice(60, ROWS)
WEST, EAST, ALL = slice(0, 380), slice(100, COLS), slice(None)
PILLAR = slice(106, 134), slice(70, 140)


def building(*pillars, seed=1):
    """Draw the walls of 24 x 12 m: rooms on both sides of a corridor, the upper half the lower one turned."""
    rng = np.random.default_rng(seed)
    half = np.zeros((ROWS // 2, COLS), dtype=bool)
    half[:3] = half[97:100] = True
    half[:, :3] = half[:, -3:] = True
    left = 0
    while left < COLS - 60:
        wide = int(rng.integers(60, 110))
        half[:100, left : left + 3] = True
        door = left + int(rng.integers(8, 40))
        half[97:100, door : door + 18] = False
        row, col = int(rng.integers(10, 60)), left + int(rng.integers(8, 35))
        half[row : row + int(rng.integers(8, 25)), col : col + int(rng.integers(8, 25))] = True
        left += wide
    walls = np.concatenate((half, half[::-1, ::-1]))
    for pillar in pillars:
        walls[pillar] = True
    return walls


def mapped(walls, rows=ALL, cols=ALL, turns=0):
    """Return the map of a robot that saw a rectangle of the building, turned by quarter turns."""
    log_odds = np.rot90(np.where(walls[rows, cols], 2.0, -2.0), turns).astype(np.float32)
    return OccupancyGrid(GridFrame(CELL, SE2.identity(), log_odds.shape), np.ascontiguousarray(log_odds))


def team(target, source):
    return MapSet(("a", "b"), (target, source), ("m", "m"))


def answer(target, source):
    (found,) = match_maps(team(target, source))
    return found


def half_turn_between(one, other):
    turn = one @ other.inverse()
    return abs(math.remainder(turn.yaw - math.pi, math.tau)) < math.radians(1.0)


@pytest.mark.parametrize(
    ("there", "here"),
    [((SOUTH, WEST), (SOUTH, EAST)), ((SOUTH, WEST), (NORTH, WEST)), ((ALL, ALL), (ALL, ALL))],
    ids=["the same half", "opposite halves", "the whole"],
)
def test_maps_of_a_symmetric_building_are_refused_with_both_placements(there, here):
    found = answer(mapped(building(), *there), mapped(building(), *here, turns=1))
    assert (found.accepted, found.reason, found.evidence.alike_placements) == (False, Reason.SYMMETRIC, 2)
    assert found.confidence <= 0.5
    assert found.reason_text == "this place looks the same turned by 180 degrees: give a prior"
    assert half_turn_between(found.alternatives[0].target_from_source, found.target_from_source)


def test_a_building_of_two_unlike_halves_is_not_symmetric():
    walls = np.concatenate((building(seed=1)[: ROWS // 2], building(seed=2)[ROWS // 2 :]))
    found = answer(mapped(walls, SOUTH, WEST), mapped(walls, SOUTH, EAST, turns=1))
    assert found.accepted and found.evidence.alike_placements == 1


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_pillar_tells_two_placements_apart_only_if_both_maps_show_it(seed):
    walls = building(PILLAR, seed=seed)
    both = answer(mapped(walls, SOUTH), mapped(walls, SOUTH, turns=1))
    assert both.accepted and both.evidence.alike_placements == 1
    one = answer(mapped(walls, SOUTH), mapped(walls, SOUTH, slice(145, 335), turns=1))  # neither it nor its image
    assert (one.accepted, one.reason) == (False, Reason.SYMMETRIC)


def test_swapping_the_maps_of_a_symmetric_building_changes_nothing():
    walls = building(PILLAR)
    maps = mapped(walls, SOUTH), mapped(walls, SOUTH, slice(145, 335), turns=1)
    there, back = answer(*maps), answer(*maps[::-1])
    assert (there.confidence, there.refusal, there.evidence) == (back.confidence, back.refusal, back.evidence)
    for one, other in [(there, back), (there.alternatives[0], back.alternatives[0])]:
        same = one.target_from_source @ other.target_from_source
        np.testing.assert_allclose(same.matrix(), Similarity2().matrix(), atol=1e-9)


def test_a_prior_chooses_one_of_two_alike_placements():
    maps = mapped(building(), SOUTH, WEST), mapped(building(), SOUTH, EAST, turns=1)
    found = answer(*maps)
    task = PairTask.of(team(*maps), 0, 1, ScaleRange.known(), MergeSettings(), 0)
    for place in (found.target_from_source, found.alternatives[0].target_from_source):
        near = match_near(GuidedTask(task, place))
        assert near.accepted and not half_turn_between(near.target_from_source, place)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_half_turns_of_a_symmetric_map_hold_that_about_its_middle(seed):
    prepared = prepare_map(mapped(building(seed=seed)))
    turns = HalfTurns(SymmetrySettings(), AlignmentSettings()).describe(prepared)
    middle = np.array(prepared.grid.frame.shape[::-1]) / 2.0
    assert min(np.abs(turn.apply(middle) - middle).max() for turn in turns) < 0.1


def test_a_map_is_described_once():
    class Counting:
        asked = 0

        def describe(self, prepared):
            self.asked += 1
            return prepared

    cache, grid, step = FeatureCache(), mapped(building()), Counting()
    assert cache.features(grid, ()).describe(step) is cache.features(grid, ()).describe(step)
    assert step.asked == 1
