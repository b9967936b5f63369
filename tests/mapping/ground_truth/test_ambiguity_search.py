"""The fast search against the slow one, which lays every turn on every shift; and the bound against what it bounds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth import ambiguity_search as second_place
from mapping.ground_truth.agreement_bound import AgreementBound, least_bound, tightest_penalty
from mapping.ground_truth.ambiguity_search import QUARTERS, ROTATION_STEP_DEG, AmbiguitySearch
from mapping.ground_truth.footprint_agreement import agreement_at, agreement_of
from mapping.ground_truth.footprint_layers import DEEP, NEAR, NEITHER, FootprintLayers
from mapping.ground_truth.rotated_footprint import FootprintRotation

NEAR_CELLS, NEAR_DEG = 2.0, 10.0
STEP = 4
SHAPE = (15, 22)


def place(seed, low=0, high=SHAPE[1]):
    """A room with boxes at random places, of which the coarse columns [low, high) were seen."""
    rng = np.random.default_rng(seed)
    fine = np.zeros((SHAPE[0] * STEP, SHAPE[1] * STEP), np.float32)
    fine[4:-5, 6:-3] = 1.0
    fine[7:-8, 9:-6] = -1.0
    for row, col in rng.uniform((8, 10), (fine.shape[0] - 14, fine.shape[1] - 12), (4, 2)).astype(int):
        fine[row : row + rng.integers(2, 8), col : col + rng.integers(2, 8)] = 1.0
    fine[:, : low * STEP] = fine[:, high * STEP :] = 0.0
    return OccupancyGrid(GridFrame(0.05, SE2(), fine.shape), fine)


def slowly(fixed, moving, centre):
    """The best agreement near the true placement and elsewhere, over all turns and all shifts that lay cell on cell."""
    walls, row, col = fixed.walls - fixed.corner, *(centre - fixed.corner)
    total, turning, near, rival = (
        float(len(fixed.walls) + len(moving.walls)),
        FootprintRotation(moving, centre),
        0.0,
        0.0,
    )
    for degrees in range(0, 360, ROTATION_STEP_DEG):
        turned = turning.turned(math.radians(degrees % 90))
        says, cells, middle = turned.says, turned.walls, turned.centre
        for _ in range(degrees // 90):  # a quarter turn counter-clockwise: (x, y) to (-y, x)
            cells = np.stack((cells[:, 1], says.shape[0] - 1 - cells[:, 0]), axis=-1)
            middle = (middle[1], says.shape[0] - 1 - middle[0])
            says = np.ascontiguousarray(says.T[:, ::-1])
        for i in range(-says.shape[0], fixed.says.shape[0] + 1):
            for j in range(-says.shape[1], fixed.says.shape[1] + 1):
                found = agreement_at(walls, fixed.says, cells, says, total, i, j)
                away = math.hypot(i + middle[0] - row, j + middle[1] - col) > NEAR_CELLS
                if away or min(degrees, 360 - degrees) > NEAR_DEG:
                    rival = max(rival, found)
                elif degrees == 0:
                    near = max(near, found)
    return near, rival


@pytest.mark.parametrize(
    ("seed", "columns"), [(0, ((0, 22), (0, 22))), (1, ((0, 15), (8, 22))), (2, ((0, 9), (8, 22)))]
)
@pytest.mark.parametrize("patience", [second_place.PATIENCE, -math.inf])
def test_the_search_finds_what_the_slow_one_finds(seed, columns, patience, monkeypatch):
    """With blocks of shifts, and, out of patience with them, with single ones."""
    monkeypatch.setattr(second_place, "PATIENCE", patience)
    fixed, moving = (FootprintLayers.of(place(seed, *one)) for one in columns)
    centre = np.array([7, 10])
    search = AmbiguitySearch(fixed, moving, centre, (NEAR_CELLS, NEAR_DEG))
    assert (search.agreement(), search.rival()) == pytest.approx(slowly(fixed, moving, centre), abs=1e-12)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 99), st.integers(0, 29), st.sampled_from([1, 2, 3]), st.floats(0.0, 5.0))
def test_no_shift_in_a_block_exceeds_its_bound(seed, turn, block, penalty):
    fixed, moving = FootprintLayers.of(place(seed)), FootprintLayers.of(place(seed + 1, 5, 17))
    walls = fixed.walls - fixed.corner
    turned = FootprintRotation(moving, np.array([7, 10])).turned(math.radians(ROTATION_STEP_DEG * turn))
    bounds = AgreementBound([(walls, fixed.says)], block, penalty).over_blocks(turned)[0]
    for row in range(-turned.says.shape[0], fixed.says.shape[0]):
        for col in range(-turned.says.shape[1], fixed.says.shape[1]):
            said = [laid(turned.walls, fixed.says, row, col), laid(walls, turned.says, -row, -col)]
            exact = sum(hits - penalty * misses for hits, misses in said)
            bound = bounds[(row // block + 1) % bounds.shape[0], (col // block + 1) % bounds.shape[1]]
            assert exact <= bound + 1e-2
            assert block > 1 or exact == pytest.approx(bound, abs=1e-2)


def laid(walls, says, row, col):
    cells = np.add(walls, (row, col))
    inside = cells[((cells >= 0) & (cells < says.shape)).all(axis=1)]
    on = says[inside[:, 0], inside[:, 1]]
    return np.count_nonzero(on == NEAR), np.count_nonzero(on == DEEP)


@given(st.integers(1, 400), st.integers(0, 400), st.integers(0, 400), st.floats(0.0, 20.0), st.floats(0.01, 0.99))
def test_what_reaches_an_agreement_reaches_its_least_bound(hits, misses, more, penalty, guess):
    total, most = 800.0, float(hits + more)
    for p in (penalty, tightest_penalty(guess, most, total)):
        for agreement in (agreement_of(hits, misses, total), guess):
            if agreement_of(hits, misses, total) >= agreement:
                assert hits - p * misses >= least_bound(agreement, p, most, total) - 1e-6


def test_a_quarter_of_all_turns_is_looked_at_and_makes_all():
    assert 360 % (QUARTERS * ROTATION_STEP_DEG) == 0


def test_the_layers_say_of_cells_what_distances_say():
    layers = FootprintLayers.of(place(3))
    fine = place(3)
    rows, cols = np.nonzero(fine.occupied)
    for i in range(layers.says.shape[0]):
        for j in range(layers.says.shape[1]):
            near = deep = 0
            for y in range(STEP * (i + layers.corner[0]), STEP * (i + layers.corner[0]) + STEP):
                for x in range(STEP * (j + layers.corner[1]), STEP * (j + layers.corner[1]) + STEP):
                    near += np.hypot(rows - y, cols - x).min() < 6
                    blocked = np.argwhere(~fine.free)
                    deep += bool(fine.free[y, x]) and np.hypot(*(blocked - (y, x)).T).min() >= 6
            assert layers.says[i, j] == (NEAR if near > 8 else DEEP if deep > 8 else NEITHER)
