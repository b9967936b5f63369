"""Mended plans: robots reach all floor that is left, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from worlds.floor import find_floor, require_drivable
from worlds.importing.cells import MAX_BOXES, world_from_cells
from worlds.importing.mending import MendingSettings, fill_pockets, mend_cells
from worlds.polygon import box
from worlds.raster import true_raster
from worlds.world import World


def hall() -> np.ndarray:
    """A hall of 8 x 5 m with walls of 0.1 m, in cells of 5 cm."""
    free = np.zeros((100, 160), dtype=bool)
    free[2:-2, 2:-2] = True
    return free


def test_a_plan_without_faults_stays_as_it_is() -> None:
    free = hall()
    free[:40, 60:70] = False
    mended = mend_cells(free, 0.05)
    assert np.array_equal(mended.free, free)
    assert (mended.resolution, mended.notes) == (0.05, ())


def test_specks_are_dropped_and_pillars_are_not() -> None:
    free = hall()
    expected = free.copy()
    free[50:52, 30:32] = False
    free[20, 20] = free[70, 100] = False
    free[40:43, 80:82] = expected[40:43, 80:82] = False
    mended = mend_cells(free, 0.05)
    assert np.array_equal(mended.free, expected)
    assert mended.notes == ("dropped 3 solid specks of at most 4 cells",)


def test_a_closed_room_is_filled_and_said_with_its_area() -> None:
    free = hall()
    free[:, 100:102] = False
    mended = mend_cells(free, 0.05)
    assert np.array_equal(np.argwhere(mended.free).max(axis=0), (97, 99))
    assert "1 part of the floor" in mended.notes[0]
    assert f"{96 * 56 * 0.0025:.1f} m^2 of" in mended.notes[0]


def test_a_room_behind_a_slit_is_filled_but_nothing_that_a_robot_reaches() -> None:
    free = hall()
    free[:50, 100:102] = free[54:, 100:102] = False  # a slit of 0.2 m
    world = World("hall", 0, (8.0, 5.0), world_from_cells("hall", free, 0.05).obstacles, parts=2)
    before = find_floor(require_drivable(world))
    after = find_floor(require_drivable(world_from_cells("hall", mend_cells(free, 0.05).free, 0.05)))
    assert np.array_equal(after.part == 1, before.part == 1)
    assert len(after.areas) == 1


def test_a_plan_of_too_many_boxes_is_coarsened_and_no_wall_gets_a_hole() -> None:
    free = hall()
    free = np.kron(free, np.ones((8, 8), dtype=bool))
    spots = np.zeros_like(free)
    spots[3::6, 3::6] = True
    free &= ~(spots | np.roll(spots, 1, axis=0) & (np.arange(free.shape[1]) % 12 < 6))
    mended = mend_cells(free, 0.05, MendingSettings(largest_speck=0.0, radius=0.02))
    assert mended.resolution > 0.05
    assert "boxes became" in mended.notes[-1]
    assert len(world_from_cells("fine", mended.free, mended.resolution).obstacles) <= MAX_BOXES
    factor = round(mended.resolution / 0.05)
    fine = np.kron(mended.free, np.ones((factor, factor), dtype=bool))[: free.shape[0], : free.shape[1]]
    assert not (fine & ~free).any()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.1]))
def test_a_mended_plan_can_always_be_explored(seed: int, resolution: float) -> None:
    rng = np.random.default_rng(seed)
    free = np.zeros((80, 120), dtype=bool)
    for row, col in rng.integers(2, (60, 90), (9, 2)):
        free[row : row + int(rng.integers(5, 18)), col : col + int(rng.integers(5, 28))] = True
    free &= rng.random(free.shape) > 0.01
    free[20:40, 20:40] = True
    cells = mend_cells(free, resolution)
    world, _ = fill_pockets(world_from_cells("rooms", cells.free, cells.resolution))
    assert require_drivable(world).parts == 1
    again, notes = fill_pockets(world)
    assert again is world
    assert notes == ()


def test_pockets_of_a_drawing_are_filled_on_its_raster() -> None:
    walls = (box(0, 0, 8, 0.1), box(0, 4.9, 8, 5), box(0, 0, 0.1, 5), box(7.9, 0, 8, 5), box(5.03, 0, 5.13, 5))
    world, notes = fill_pockets(World("two rooms", 0, (8.0, 5.0), walls, parts=2))
    assert len(notes) == 1
    assert require_drivable(world).parts == 1
    kept = true_raster(world).free
    assert not kept[:, 101:].any()
    assert np.array_equal(kept[:, :101], true_raster(World("two rooms", 0, (8.0, 5.0), walls, parts=2)).free[:, :101])


def test_plans_that_cannot_be_mended_are_refused() -> None:
    with pytest.raises(ValueError, match="no free floor on which a robot"):
        mend_cells(np.pad(np.ones((5, 5), dtype=bool), 3), 0.05)
    noise = np.random.default_rng(0).random((900, 900)) < 0.6
    noise[:30, :30] = True
    with pytest.raises(ValueError, match="are not coarse enough"):
        mend_cells(np.pad(noise, 1), 0.05, MendingSettings(largest_speck=0.0, radius=0.01, coarsest=0.05))


def test_gaps_of_less_than_a_tenth_of_a_square_metre_are_closed_in_silence() -> None:
    free = np.ones((100, 100), dtype=bool)
    free[[0, -1]] = free[:, [0, -1]] = False
    free[40:43, 40:43] = False
    free[41, 41] = True
    mended = mend_cells(free, 0.05)
    assert not mended.free[41, 41]
    assert mended.notes == ()
