"""PyBullet's lidar compared with an analytic one, and motion and contacts of bodies."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from sim.physics import bullet
from sim.physics.bullet import MAX_RAYS, BulletScene
from sim.physics.drive import DriveLimits
from sim.physics.robot import MAX_ROBOTS, RobotSettings
from sim.sensors.lidar import Lidar
from worlds.families.registry import make_world
from worlds.polygon import box
from worlds.world import World

MOUNTED = SE2(0.11, -0.07, 0.83)


def first_hits(segments: np.ndarray, world_from_lidar: SE2, lidar: Lidar) -> np.ndarray:
    """Exact distance to the first segment along each beam, +inf beyond the range: the oracle."""
    origin = np.array((world_from_lidar.x, world_from_lidar.y))
    angles = world_from_lidar.yaw + lidar.angle_min + lidar.angle_increment * np.arange(lidar.beams)
    reach = np.full(lidar.beams, math.inf)
    for a, b in segments:
        side, offset = b - a, a - origin
        across = np.cos(angles) * side[1] - np.sin(angles) * side[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (offset[0] * side[1] - offset[1] * side[0]) / across
            share = (offset[0] * np.sin(angles) - offset[1] * np.cos(angles)) / across
        hit = (distance >= 0.0) & (share >= 0.0) & (share <= 1.0)
        reach = np.where(hit, np.minimum(reach, np.where(hit, distance, math.inf)), reach)
    reach[reach > lidar.range_max] = math.inf
    return reach


def assert_alike(measured: np.ndarray, exact: np.ndarray) -> None:
    """Equal up to 0.1 mm but for two beams in a thousand, which graze a corner."""
    with np.errstate(invalid="ignore"):
        alike = (measured == exact) | (np.abs(measured - exact) < 1e-4)
    assert alike.mean() > 0.998


@pytest.mark.parametrize("mounting", [SE2(), MOUNTED])
@pytest.mark.parametrize("range_max", [2.5, 7.0])
def test_the_lidar_equals_analytic_ray_casting(two_rooms: World, mounting: SE2, range_max: float) -> None:
    lidar = Lidar(range_max=range_max, base_from_lidar=mounting)
    for start in (SE2(1.5, 3.7, 0.4), SE2(5.3, 2.2, -2.6), SE2(3.3, 1.0, 3.0)):
        with BulletScene(two_rooms, [start]) as scene:
            distances, hits_robot = scene.cast(0, lidar)
        assert_alike(distances, first_hits(two_rooms.segments(), start @ mounting, lidar))
        assert not hits_robot.any()


def test_walls_of_more_sides_than_one_mesh_takes_are_all_seen(
    two_rooms: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    start, lidar = SE2(1.5, 3.7, 0.4), Lidar(range_max=7.0)
    monkeypatch.setattr(bullet, "MESH_SIDES", 5)
    with BulletScene(two_rooms, [start]) as scene:
        distances, hits_robot = scene.cast(0, lidar)
    assert_alike(distances, first_hits(two_rooms.segments(), start, lidar))
    assert not hits_robot.any()


@pytest.mark.slow
def test_a_world_of_ten_thousand_boxes_can_be_simulated() -> None:
    boxes = tuple(box(x, y, x + 0.1, y + 0.1) for x in np.arange(100) * 0.3 for y in np.arange(100) * 0.3)
    with BulletScene(World("grove", 0, (30.0, 30.0), boxes), [SE2(0.2, 0.2, 0.0)]) as scene:
        (ahead, *_), _ = scene.cast(0, Lidar(beams=1, angle_min=0.0, range_min=0.0))
    assert ahead == math.inf


def test_the_mounting_pose_matters(two_rooms: World) -> None:
    """Otherwise the test above could not detect a lidar that ignores it."""
    start, lidar = SE2(1.5, 3.7, 0.4), Lidar(base_from_lidar=MOUNTED)
    with BulletScene(two_rooms, [start]) as scene:
        distances, _ = scene.cast(0, lidar)
    forgotten = first_hits(two_rooms.segments(), start, lidar)
    assert (np.abs(distances - forgotten) < 1e-4).mean() < 0.5


def test_the_lidar_is_right_at_many_places_of_an_office() -> None:
    world, lidar = make_world("office", 2), Lidar(beams=720, angle_increment=math.tau / 720)
    rng = np.random.default_rng(0)
    places = rng.uniform((0.5, 0.5), np.array(world.size) - 0.5, (40, 2))
    starts = [SE2(x, y, rng.uniform(-3, 3)) for x, y in places[world.clearance(places) > 0.3]][:8]
    measured, exact = [], []
    for start in starts:
        with BulletScene(world, [start]) as scene:
            measured.append(scene.cast(0, lidar)[0])
        exact.append(first_hits(world.segments(), start, lidar))
    assert_alike(np.concatenate(measured), np.concatenate(exact))


def test_a_miss_is_infinite_and_no_hit_at_the_origin() -> None:
    world = World("nothing near", 0, (50, 50), make_world("office", 0).obstacles)
    with BulletScene(world, [SE2(45.0, 45.0, 0.3)]) as scene:
        distances, hits_robot = scene.cast(0, Lidar())
    assert (distances == math.inf).all()
    assert not hits_robot.any()


def test_a_world_without_walls_gives_no_returns() -> None:
    with BulletScene(World("nothing", 0, (5, 5), ()), [SE2(2, 2, 0)]) as scene:
        assert (scene.cast(0, Lidar())[0] == math.inf).all()


def test_more_beams_than_one_call_takes_are_all_cast(two_rooms: World) -> None:
    beams = 2 * MAX_RAYS + 17
    lidar = Lidar(beams=beams, angle_increment=math.tau / beams)
    start = SE2(1.5, 3.7, 0.4)
    with BulletScene(two_rooms, [start]) as scene:
        distances, _ = scene.cast(0, lidar)
    assert distances.shape == (beams,)
    assert_alike(distances, first_hits(two_rooms.segments(), start, lidar))


def test_a_robot_sees_the_others_and_not_itself() -> None:
    world = World("nothing", 0, (9, 9), ())
    lidar = Lidar(base_from_lidar=SE2(0.1, 0.0, math.pi))
    with BulletScene(world, [SE2(2, 4, 0.0), SE2(5, 4, 1.0), SE2(2, 8, 0.0)], RobotSettings(radius=0.25)) as scene:
        distances, hits_robot = scene.cast(0, lidar)
    seen = np.flatnonzero(hits_robot)
    assert np.array_equal(seen, np.flatnonzero(np.isfinite(distances)))
    ahead = 0  # the lidar is turned round, so its first beam, at -pi, looks forward
    assert distances[ahead] == pytest.approx(3.0 - 0.1 - 0.25, abs=1e-3)
    half_width = math.asin(0.25 / 2.9)
    bearings = math.pi + lidar.angles[seen]
    assert np.count_nonzero(np.abs(np.sin(bearings)) <= math.sin(half_width) + 0.02) >= 8
    left = np.flatnonzero(np.abs(lidar.angles + math.pi / 2) < 0.02)
    assert np.isfinite(distances[left]).all()


def test_a_robot_drives_a_commanded_arc_upright() -> None:
    at_once = RobotSettings(limits=DriveLimits(acceleration=100.0, turn_acceleration=100.0))
    with BulletScene(World("nothing", 0, (9, 9), ()), [SE2(4, 4, 0.5)], at_once) as scene:
        touched = scene.advance([(0.5, 0.8)], 0.01, 300)
        end = scene.pose(0)
    radius, angle = 0.5 / 0.8, 0.8 * 3.0
    expected = SE2(4, 4, 0.5) @ SE2(radius * math.sin(angle), radius * (1 - math.cos(angle)), angle)
    assert math.dist((end.x, end.y), (expected.x, expected.y)) < 0.01
    assert end.yaw == pytest.approx(expected.yaw, abs=1e-6)
    assert not touched.any()


def test_walls_stop_a_robot_and_count_as_touches(two_rooms: World) -> None:
    with BulletScene(two_rooms, [SE2(1.0, 2.5, math.pi), SE2(2.5, 2.5, 0.0)]) as scene:
        touched = scene.advance([(0.6, 0.0), (0.0, 0.0)], 0.01, 300)
        pose = scene.pose(0)
    assert touched.tolist() == [True, False]
    assert pose.x == pytest.approx(0.2 + 0.2, abs=0.01)
    assert pose.yaw == pytest.approx(math.pi) or pose.yaw == pytest.approx(-math.pi)


def test_robots_stop_one_another() -> None:
    with BulletScene(World("nothing", 0, (9, 9), ()), [SE2(2, 4, 0.0), SE2(4, 4, math.pi)]) as scene:
        touched = scene.advance([(0.6, 0.0), (0.6, 0.0)], 0.01, 400)
        assert touched.all()
        assert math.dist((scene.pose(0).x, scene.pose(0).y), (scene.pose(1).x, scene.pose(1).y)) > 0.39


def test_too_many_robots_are_refused() -> None:
    with pytest.raises(ValueError, match=f"{MAX_ROBOTS + 1} robots"):
        BulletScene(World("nothing", 0, (9, 9), ()), [SE2()] * (MAX_ROBOTS + 1))


@pytest.mark.slow
def test_without_pybullet_sim_imports_and_simulate_raises() -> None:
    program = """
import sys
sys.modules["pybullet"] = None
from sim.mission import file, settings, simulation
from sim.policies import explore
from sim.sensors import noise
from worlds.families.registry import make_world
try:
    simulation.simulate(make_world("office", 0), settings.MissionSettings(duration=1.0), 0)
except ImportError as error:
    print(error)
"""
    output = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert "no wheel after Python 3.11" in output
    assert output.count("\n") == 1


def test_a_lidar_on_a_boom_looks_through_its_own_robot() -> None:
    """A ray that starts inside the body misses it anyway; from outside, only the collision mask excludes it."""
    lidar = Lidar(base_from_lidar=SE2(-0.4, 0.0, 0.0))
    with BulletScene(World("nothing", 0, (9, 9), ()), [SE2(4, 4, 0.0), SE2(6, 4, 0.0)]) as scene:
        distances, _ = scene.cast(0, lidar)
    assert distances[180] == pytest.approx(2.0 + 0.4 - 0.2, abs=1e-3)
