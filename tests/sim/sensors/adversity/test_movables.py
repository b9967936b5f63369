"""Doors and objects stand for a while, and make way for robots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mapping.robot.trajectory import Trajectory
from sim.sensors.adversity.doorways import find_doorways
from sim.sensors.adversity.free_floor import FreeFloor, free_floor
from sim.sensors.adversity.movables import Movables, move_things
from sim.sensors.adversity.settings import STEP, Adversity
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World

DOORS, OBJECTS = Adversity(doors=1.0), Adversity(objects=20.0)
FAR = np.full((3000, 1, 2), 1e3)


@pytest.fixture(scope="module")
def floor(two_rooms: World) -> FreeFloor:
    here = Trajectory(np.array([0.0, 60.0]), np.tile((2.0, 2.0, 0.0), (2, 1)))
    return free_floor(two_rooms, [here], 0.22)


def test_the_doorway_between_two_rooms_is_found(two_rooms: World) -> None:
    (doorway,) = find_doorways(two_rooms)
    assert np.sort(doorway[:, 1]) == pytest.approx((2.0, 3.0))
    assert set(doorway[:, 0]) <= {4.0, 4.2}


def test_each_door_of_an_office_is_found() -> None:
    """An office has the doors of its rooms, and no furniture that could be taken for one."""
    assert len(find_doorways(make_world("office", 1))) == 23


def test_narrow_wide_and_blocked_gaps_are_no_doorways() -> None:
    def gaps(width: float, *more) -> int:
        walls = (box(4, 0, 4.2, 2), box(4, 2 + width, 4.2, 6))
        return len(find_doorways(World("gap", 0, (8.0, 6.0), (*walls, *more))))

    assert [gaps(width) for width in (0.5, 0.8, 1.3, 1.6)] == [0, 1, 1, 0]
    assert gaps(0.9, box(4.05, 2.4, 4.15, 2.5)) == 0
    assert gaps(0.9, box(4.5, 1.9, 4.7, 3.0)) == 0
    assert find_doorways(World("open", 0, (8.0, 6.0), ())).shape == (0, 2, 2)


def closed(things: Movables, times: np.ndarray) -> np.ndarray:
    return np.array([len(things.at(time)) for time in times])


def test_doors_are_closed_half_of_the_time_for_their_mean_time(two_rooms: World, floor: FreeFloor) -> None:
    doorways = np.repeat(find_doorways(two_rooms), 200, axis=0)
    things = move_things(doorways, floor, FAR, DOORS, 5)
    assert closed(things, np.arange(0.0, 300.0, 10.0)).mean() / 200 == pytest.approx(0.5, abs=0.03)
    whole = things.times[:, 1] < 300.0 * 0.3
    assert np.diff(things.times[whole & (things.times[:, 0] > 0.0)]).mean() < 30.0  # long ones are cut off
    assert np.diff(things.times[things.times[:, 0] < 150.0]).mean() == pytest.approx(30.0, rel=0.15)


def test_a_robot_opens_the_door_and_passes(two_rooms: World, floor: FreeFloor) -> None:
    doorways, times = find_doorways(two_rooms), np.arange(3000) * STEP
    robots = np.stack((np.interp(times, (0.0, 300.0), (1.0, 7.0)), np.full(3000, 2.5)), axis=-1)[:, None]
    near = np.hypot(*(robots[:, 0] - doorways[0].mean(axis=0)).T) < DOORS.opening_distance
    for seed in range(20):
        things, alone = (move_things(doorways, floor, each, DOORS, seed) for each in (robots, FAR))
        assert not closed(things, times[near]).any()
        before = times[: near.argmax()]
        assert np.array_equal(closed(things, before), closed(alone, before))


def test_objects_come_and_go_on_free_floor(floor: FreeFloor) -> None:
    things = move_things(np.empty((0, 2, 2)), floor, FAR, OBJECTS, 5)
    count = floor.count(OBJECTS.objects)
    standing = closed(things, np.arange(0.0, 300.0, 1.0)) / 4
    assert 0.0 <= standing.min() < standing.mean() < standing.max() <= count
    boxes = things.segments.reshape(-1, 4, 2, 2)
    assert np.hypot(*np.moveaxis(boxes[:, :, 1] - boxes[:, :, 0], -1, 0)) == pytest.approx(OBJECTS.object_size)
    assert len(np.unique(boxes[:, :, 0].mean(axis=1).round(2), axis=0)) > count


def test_fewer_doors_and_objects_are_among_more(two_rooms: World, floor: FreeFloor) -> None:
    doorways = np.repeat(find_doorways(two_rooms), 30, axis=0)
    for much, less in ((DOORS, replace(DOORS, doors=0.4)), (OBJECTS, replace(OBJECTS, objects=9.0))):
        more, fewer = (move_things(doorways, floor, FAR, each, 5) for each in (much, less))
        rows = [
            {(*a, *b) for a, b in zip(x.segments.reshape(-1, 4).tolist(), x.times.tolist(), strict=True)}
            for x in (fewer, more)
        ]
        assert 0 < len(rows[0]) < len(rows[1])
        assert rows[0] < rows[1]
    assert not len(move_things(doorways, floor, FAR, Adversity(), 5).segments)
