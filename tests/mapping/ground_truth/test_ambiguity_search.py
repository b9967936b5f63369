"""The fast search compared with an exhaustive one, and the bound with the scores that it bounds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth import ambiguity_search
from mapping.ground_truth.ambiguity_search import QUARTERS, ROTATION_STEP_DEG, AmbiguitySearch
from mapping.ground_truth.coarse_footprint import CoarseFootprint, FootprintRotation
from mapping.ground_truth.wall_agreement import (
    HIT,
    MISS,
    NEUTRAL,
    AgreementBound,
    least_bound,
    tightest_penalty,
    wall_agreement,
    wall_agreement_at,
)

NEAR_CELLS, NEAR_DEG = 2.0, 10.0
STEP = 4
SHAPE = (15, 22)


def place(seed, low=0, high=SHAPE[1]):
    """Make a room with boxes at random places, of which the coarse columns [low, high) were seen."""
    rng = np.random.default_rng(seed)
    fine = np.zeros((SHAPE[0] * STEP, SHAPE[1] * STEP), np.float32)
    fine[4:-5, 6:-3] = 1.0
    fine[7:-8, 9:-6] = -1.0
    for row, col in rng.uniform((8, 10), (fine.shape[0] - 14, fine.shape[1] - 12), (4, 2)).astype(int):
        fine[row : row + rng.integers(2, 8), col : col + rng.integers(2, 8)] = 1.0
    fine[:, : low * STEP] = fine[:, high * STEP :] = 0.0
    return OccupancyGrid(GridFrame(0.05, SE2(), fine.shape), fine)


def exhaustive(fixed, moving, centre):
    """Return the best score near the true placement and elsewhere, over all rotations and shifts to whole cells."""
    walls, row, col = fixed.walls - fixed.corner, *(centre - fixed.corner)
    total, turning, near, second_best = (
        float(len(fixed.walls) + len(moving.walls)),
        FootprintRotation(moving, centre),
        0.0,
        0.0,
    )
    for degrees in range(0, 360, ROTATION_STEP_DEG):
        turned = turning.rotated(math.radians(degrees % 90))
        labels, cells, middle = turned.labels, turned.walls, turned.centre
        for _ in range(degrees // 90):  # a quarter turn counter-clockwise: (x, y) to (-y, x)
            cells = np.stack((cells[:, 1], labels.shape[0] - 1 - cells[:, 0]), axis=-1)
            middle = (middle[1], labels.shape[0] - 1 - middle[0])
            labels = np.ascontiguousarray(labels.T[:, ::-1])
        for i in range(-labels.shape[0], fixed.labels.shape[0] + 1):
            for j in range(-labels.shape[1], fixed.labels.shape[1] + 1):
                found = wall_agreement_at(walls, fixed.labels, cells, labels, total, i, j)
                away = math.hypot(i + middle[0] - row, j + middle[1] - col) > NEAR_CELLS
                if away or min(degrees, 360 - degrees) > NEAR_DEG:
                    second_best = max(second_best, found)
                elif degrees == 0:
                    near = max(near, found)
    return near, second_best


@pytest.mark.parametrize(
    ("seed", "columns"), [(0, ((0, 22), (0, 22))), (1, ((0, 15), (8, 22))), (2, ((0, 9), (8, 22)))]
)
@pytest.mark.parametrize("patience", [ambiguity_search.PATIENCE, -math.inf])
def test_the_search_equals_the_exhaustive_one(seed, columns, patience, monkeypatch):
    """With blocks of shifts, and with single shifts."""
    monkeypatch.setattr(ambiguity_search, "PATIENCE", patience)
    fixed, moving = (CoarseFootprint.of(place(seed, *one)) for one in columns)
    centre = np.array([7, 10])
    search = AmbiguitySearch(fixed, moving, centre, (NEAR_CELLS, NEAR_DEG))
    assert (search.true_score(), search.second_best()) == pytest.approx(exhaustive(fixed, moving, centre), abs=1e-12)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 99), st.integers(0, 29), st.sampled_from([1, 2, 3]), st.floats(0.0, 5.0))
def test_no_shift_in_a_block_exceeds_its_bound(seed, turn, block, penalty):
    fixed, moving = CoarseFootprint.of(place(seed)), CoarseFootprint.of(place(seed + 1, 5, 17))
    walls = fixed.walls - fixed.corner
    turned = FootprintRotation(moving, np.array([7, 10])).rotated(math.radians(ROTATION_STEP_DEG * turn))
    bounds = AgreementBound([(walls, fixed.labels)], block, penalty).over_blocks(turned.walls, turned.labels)[0]
    for row in range(-turned.labels.shape[0], fixed.labels.shape[0]):
        for col in range(-turned.labels.shape[1], fixed.labels.shape[1]):
            there = hits_and_misses(turned.walls, fixed.labels, row, col)
            back = hits_and_misses(walls, turned.labels, -row, -col)
            exact = sum(hits - penalty * misses for hits, misses in (there, back))
            bound = bounds[(row // block + 1) % bounds.shape[0], (col // block + 1) % bounds.shape[1]]
            assert exact <= bound + 1e-2
            assert block > 1 or exact == pytest.approx(bound, abs=1e-2)


def hits_and_misses(walls, labels, row, col):
    cells = np.add(walls, (row, col))
    inside = cells[((cells >= 0) & (cells < labels.shape)).all(axis=1)]
    on = labels[inside[:, 0], inside[:, 1]]
    return np.count_nonzero(on == HIT), np.count_nonzero(on == MISS)


@given(st.integers(1, 400), st.integers(0, 400), st.integers(0, 400), st.floats(0.0, 20.0), st.floats(0.01, 0.99))
def test_placements_that_reach_a_score_reach_its_bound(hits, misses, more, penalty, guess):
    total, most = 800.0, float(hits + more)
    for p in (penalty, tightest_penalty(guess, most, total)):
        for agreement in (wall_agreement(hits, misses, total), guess):
            if wall_agreement(hits, misses, total) >= agreement:
                assert hits - p * misses >= least_bound(agreement, p, most, total) - 1e-6


def test_rotation_steps_divide_a_quarter_turn():
    assert 360 % (QUARTERS * ROTATION_STEP_DEG) == 0


def test_labels_agree_with_distances_to_walls_and_unknown_space():
    coarse = CoarseFootprint.of(place(3))
    fine = place(3)
    rows, cols = np.nonzero(fine.occupied)
    for i in range(coarse.labels.shape[0]):
        for j in range(coarse.labels.shape[1]):
            near = deep = 0
            for y in range(STEP * (i + coarse.corner[0]), STEP * (i + coarse.corner[0]) + STEP):
                for x in range(STEP * (j + coarse.corner[1]), STEP * (j + coarse.corner[1]) + STEP):
                    near += np.hypot(rows - y, cols - x).min() < 6
                    blocked = np.argwhere(~fine.free)
                    deep += bool(fine.free[y, x]) and np.hypot(*(blocked - (y, x)).T).min() >= 6
            assert coarse.labels[i, j] == (HIT if near > 8 else MISS if deep > 8 else NEUTRAL)
