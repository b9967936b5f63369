"""People walk at their speed on free floor, and make way for robots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.free_floor import CELL, FreeFloor, clear_length, free_floor, on_floor
from sim.sensors.adversity.people import People, walk
from sim.sensors.adversity.settings import STEP, Adversity
from worlds.polygon import box
from worlds.world import World

BUSY = Adversity(people=20.0, person_pause=2.0)
FAR = np.full((900, 1, 2), 1e3)


def still(x: float, y: float) -> Trajectory:
    return Trajectory(np.array([0.0, 60.0]), np.tile((x, y, 0.0), (2, 1)))


@pytest.fixture(scope="module")
def floor(two_rooms: World) -> FreeFloor:
    return free_floor(two_rooms, [still(2.0, 2.0)], BUSY.person_radius)


def inside(floor: FreeFloor, places: np.ndarray) -> bool:
    return all(on_floor(floor.cells, x, y) for x, y in places.reshape(-1, 2))


def test_people_walk_at_their_own_speed_on_free_floor(floor: FreeFloor) -> None:
    places = walk(floor, FAR, BUSY, 3).places
    speeds = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0)) / STEP
    assert inside(floor, places)
    fastest = speeds.max(axis=0)
    assert ((fastest > 0.4) & (fastest < BUSY.person_speed + 4.0 * BUSY.person_speed_sigma)).all()
    assert abs(fastest.mean() - BUSY.person_speed) < 0.3
    assert (speeds <= fastest + 1e-9).all()
    at_full_speed = np.isclose(speeds, fastest).sum(axis=0)
    assert (at_full_speed > 0.3 * (speeds > 0.0).sum(axis=0)).all()


def test_a_person_persists_and_gets_about(floor: FreeFloor) -> None:
    places = walk(floor, FAR, BUSY, 3).places
    assert np.ptp(places, axis=0).max() > 3.0
    stands = (np.diff(places, axis=0) == 0.0).all(axis=2).mean()
    assert 0.2 < stands < 0.95


def test_fewer_people_are_among_more(floor: FreeFloor) -> None:
    few, many = (walk(floor, FAR, replace(BUSY, people=density), 3).places for density in (5.0, 20.0))
    assert 0 < few.shape[1] < many.shape[1]
    assert np.array_equal(few, many[:, : few.shape[1]])
    assert walk(floor, FAR, replace(BUSY, people=0.0), 3).places.shape[1] == 0


def test_people_know_nothing_of_the_future(floor: FreeFloor) -> None:
    late = FAR.copy()
    late[400:] = 2.0, 2.5
    assert np.array_equal(walk(floor, FAR, BUSY, 3).places[:400], walk(floor, late, BUSY, 3).places[:400])


def test_people_make_way_for_a_robot(floor: FreeFloor) -> None:
    times = np.arange(900) * STEP
    robots = np.stack((1.5 + 0.05 * times, np.full(900, 2.4)), axis=-1)[:, None]
    unaware, aware = (walk(floor, near, BUSY, 3).places for near in (FAR, robots))
    gaps = [np.hypot(*np.moveaxis(places - robots, -1, 0)) for places in (unaware, aware)]
    assert gaps[0].min() < 0.2
    assert gaps[1][50:].min() > 0.6
    assert inside(floor, aware)
    assert np.array_equal(walk(floor, robots, BUSY, 3).places, aware)


def test_the_floor_keeps_clear_of_walls_and_of_other_rooms() -> None:
    walls = (box(0, 0, 8, 0.2), box(0, 3.8, 8, 4), box(0, 0, 0.2, 4), box(7.8, 0, 8, 4), box(3.9, 0, 4.1, 4))
    world = World("closed rooms", 0, (8.0, 4.0), walls)
    middles = free_floor(world, [still(2.0, 2.0)], 0.3).middles
    assert middles[:, 0].max() < 3.9 - 0.3 + CELL
    assert world.clearance(middles).min() > 0.3 - CELL
    assert len(free_floor(world, [still(2.0, 2.0), still(6.0, 2.0)], 0.3).middles) > 1.9 * len(middles)


def test_a_walk_is_clear_up_to_the_wall() -> None:
    cells = np.ones((10, 40), dtype=bool)
    cells[:, 25] = False
    assert clear_length(cells, 0.05, 0.55, 1.0, 0.0, 20.0) == pytest.approx(2.4)
    assert clear_length(cells, 0.05, 0.55, 1.0, 0.0, 1.0) == pytest.approx(1.0)


def test_places_are_interpolated_and_stay_at_the_end() -> None:
    people = People(np.array([[(0.0, 0.0)], [(1.0, 2.0)]]), 0.2)
    assert people.at(0.25 * STEP)[0] == pytest.approx((0.25, 0.5))
    assert people.at(1.0 * STEP)[0] == pytest.approx((1.0, 2.0))
