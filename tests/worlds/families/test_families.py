"""Laws of every family of worlds and every seed."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from mapping.seeds import Role, stream
from worlds.building.floor_plan import FloorPlan
from worlds.building.partition import partition
from worlds.families.hospital import hospital_plan
from worlds.families.registry import FAMILIES, make_world
from worlds.families.symmetric import symmetric_half
from worlds.families.thesis_floor import thesis_floor_plan
from worlds.floor import find_floor, require_drivable
from worlds.polygon import edges, is_simple, signed_area
from worlds.raster import touched_cells, true_raster
from worlds.world import World

SLOW = dict.fromkeys(("hospital", "disjoint", "thesis_floor", "outdoor", "house", "office", "warehouse"), range(7))
SEEDS = {name: range(20) for name in FAMILIES} | SLOW | {"thesis_hall": range(1)}
CASES = [pytest.param(name, seed, id=f"{name}-{seed}") for name in FAMILIES for seed in SEEDS[name]]
FIXED = ("thesis_hall",)


@cache
def named(name: str, seed: int) -> World:
    return make_world(name, seed)


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_robots_can_drive_everywhere_and_obstacles_are_not_tiny(name: str, seed: int) -> None:
    world = named(name, seed)
    floor = find_floor(world, radius=0.2, resolution=0.1)
    assert len(floor.areas) == world.parts
    assert sum(floor.areas) > 0.2 * (world.size[0] * world.size[1])
    for polygon in world.obstacles:
        assert signed_area(polygon) >= 0.01
        assert min(_thickness(polygon), 0.1 + 1e-9) >= 0.1 - 1e-9
        assert is_simple(polygon)


def _thickness(polygon: np.ndarray) -> float:
    """The least width of a convex polygon; of others, which are blocks and rock, +inf."""
    start, end = edges(polygon).transpose(1, 0, 2)
    along = end - start
    normal = np.stack((-along[:, 1], along[:, 0]), axis=-1) / np.hypot(*along.T)[:, None]
    depth = np.einsum("sk,psk->ps", normal, polygon[:, None] - start)
    return math.inf if depth.min() < -1e-9 else float(depth.max(axis=0).min())


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_the_seed_decides_everything(name: str) -> None:
    assert make_world(name, 1) == make_world(name, 1)
    if name not in FIXED:
        first, second = (true_raster(named(name, seed), 0.1).occupied for seed in (0, 1))
        assert (first != second).sum() > 0.1 * first.sum()


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in FAMILIES if name not in FIXED])
def test_other_sizes_hold_the_guarantees_and_tiny_ones_are_refused_by_value(name: str) -> None:
    family = FAMILIES[name]
    for grow in (0.85, 1.2):
        world = make_world(name, 3, family.width * grow, family.height * grow)
        assert world.size == (family.width * grow, family.height * grow)
        assert require_drivable(world) is world
    with pytest.raises(ValueError, match=f"{name}: width is 4 m, too small"):
        make_world(name, 0, width=4.0)
    with pytest.raises(ValueError, match=f"{name}: height is 3 m, too small"):
        make_world(name, 0, height=3.0)


@pytest.mark.parametrize("width", [0.0, -3.0, math.nan, math.inf, 1e6])
def test_impossible_sizes_are_refused(width: float) -> None:
    with pytest.raises(ValueError, match="width is"):
        make_world("maze", 0, width=width)


def _plans(seed: int) -> list[FloorPlan]:
    rng = np.random.default_rng(seed)
    return [
        partition(rng, 15.0, 12.0),
        hospital_plan(rng, 60.0, 30.0),
        thesis_floor_plan(rng, 49.0, 37.0),
        symmetric_half(rng, 30.0, 16.0),
    ]


@pytest.mark.parametrize("seed", range(10))
def test_every_room_has_a_door_of_90_cm_that_is_open_in_the_bare_building(seed: int) -> None:
    for plan in _plans(seed):
        bare = World("bare", 0, (plan.length, plan.depth), plan.walls)
        for door in plan.doors:
            assert door.width >= 0.9
            across = np.array((0.0, 1.0)) if door.along_x else np.array((1.0, 0.0))
            way = np.array((door.x, door.y)) + np.linspace(-0.4, 0.4, 17)[:, None] * across
            assert bare.clearance(way).min() >= 0.45
        rooms = [room for room in plan.rooms if room.kind in ("room", "store")]
        for room in rooms:
            assert any(
                room.x0 - 0.2 <= door.x <= room.x1 + 0.2 and room.y0 - 0.2 <= door.y <= room.y1 + 0.2
                for door in plan.doors
            )


@pytest.mark.parametrize("seed", range(6))
def test_furniture_leaves_doors_of_the_thesis_floor_open(seed: int) -> None:
    world = named("thesis_floor", seed)
    plan = thesis_floor_plan(stream(seed, Role.WORLD), *world.size)
    for door in plan.doors:
        across = np.array((0.0, 1.0)) if door.along_x else np.array((1.0, 0.0))
        way = np.array((door.x, door.y)) + np.linspace(-0.6, 0.6, 25)[:, None] * across
        assert world.clearance(way).min() >= 0.45


@pytest.mark.parametrize("seed", SEEDS["cave"])
def test_no_wall_of_a_cave_is_straight(seed: int) -> None:
    world = named("cave", seed)
    segments = world.segments()
    along = segments[:, 1] - segments[:, 0]
    long = np.hypot(*along.T) >= 0.6
    outward = np.stack((along[:, 1], -along[:, 0]), axis=-1)[long] / np.hypot(*along[long].T)[:, None]
    for share in (0.05, 0.35, 0.65, 0.95):
        beside = segments[long, 0] + share * along[long] + 1e-5 * outward
        leaves = ((beside <= 0.0) | (beside >= world.size)).any(axis=1)
        assert (leaves | (world.clearance(beside) == 0.0)).all()
    for polygon in world.obstacles:
        if len(polygon) > 200:  # four sides in a row of a wall leave their chord
            _assert_curved(polygon, world)


def _assert_curved(polygon: np.ndarray, world: World) -> None:
    inside = (polygon > 0.3).all(axis=1) & (polygon < np.array(world.size) - 0.3).all(axis=1)
    run = np.flatnonzero(inside[:-12] & inside[12:])
    chord = polygon[run + 12] - polygon[run]
    length = np.hypot(*chord.T)
    middle = polygon[run[:, None] + np.arange(13)] - polygon[run, None]
    off = np.abs(middle[..., 0] * chord[:, None, 1] - middle[..., 1] * chord[:, None, 0]) / length[:, None]
    assert np.mean(off.max(axis=1) > 0.02) > 0.97


@pytest.mark.parametrize("seed", SEEDS["symmetric"])
def test_a_symmetric_world_has_rotational_but_no_mirror_symmetry(seed: int) -> None:
    occupied = true_raster(named("symmetric", seed)).occupied
    assert np.array_equal(occupied, occupied[::-1, ::-1])
    assert (occupied != occupied[::-1]).sum() > 0.2 * occupied.sum()


@pytest.mark.parametrize("seed", SEEDS["outdoor"])
def test_outdoors_has_no_wall_at_the_fence(seed: int) -> None:
    world = named("outdoor", seed)
    assert world.fence is not None
    assert is_simple(world.fence)
    along = np.linspace(0.0, 1.0, 50)[:, None]
    points = np.concatenate([start + along * (end - start) for start, end in edges(world.fence)])
    unfenced = World("unfenced", 0, world.size, world.obstacles)
    assert unfenced.clearance(points).min() > 0.3
    assert max(np.ptp(polygon, axis=0).max() for polygon in world.obstacles) < 7.0
    inside = touched_cells([world.fence], 0.1, true_raster(world, 0.1).frame.shape)
    assert inside.mean() > 0.5


def test_the_thesis_hall_has_the_dimensions_of_the_thesis() -> None:
    world = named("thesis_hall", 0)
    origin = np.array((10.02, 10.01))
    assert len(world.obstacles) == 4 + 5 + 1 + 7 + 5
    centres = [np.round(polygon.mean(axis=0) - origin, 6).tolist() for polygon in world.obstacles]
    for centre in ([6.98, -0.52], [-3.51, -6.98], [-8.0, 0.0], [8.52, 4.52], [-4.5, 5.51]):
        assert centre in centres
    inner = [polygon - origin for polygon in world.obstacles[:4]]
    assert [inner[0][:, 0].max(), inner[1][:, 0].min()] == pytest.approx([-9.02, 9.01])
    assert [inner[2][:, 1].max(), inner[3][:, 1].min()] == pytest.approx([-9.01, 9.0])
    assert [(start.x - 10.02, start.y - 10.01) for start in world.starts[:2]] == [(0, 0), pytest.approx((-2, 3))]
    with pytest.raises(ValueError, match=r"thesis_hall: width is 30 m, but the hall has one size"):
        make_world("thesis_hall", 0, width=30.0)
