"""Laws of offices for every seed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import ndimage

from mapping.seeds import Role, stream
from worlds.building.clutter import furnish
from worlds.building.floor_plan import FloorPlan, draw_floor_plan
from worlds.families.office import office
from worlds.families.registry import make_world
from worlds.polygon import signed_area
from worlds.raster import true_raster
from worlds.world import World

SEEDS = range(10)


@cache
def furnished(seed: int) -> tuple[FloorPlan, World]:
    rng = np.random.default_rng(seed)
    plan = draw_floor_plan(rng, 30.0, 20.0)
    return plan, World("office", seed, (30.0, 20.0), (*plan.walls, *furnish(rng, plan)))


@cache
def named(seed: int) -> World:
    return make_world("office", seed)


def floors(world: World, radius: float) -> tuple[np.ndarray, int]:
    """Cells of 5 cm where a robot of that radius stands, labelled by what it can drive between."""
    raster = true_raster(world)
    room = ndimage.distance_transform_edt(raster.free) * raster.frame.resolution
    labels, count = ndimage.label(room > radius, structure=np.ones((3, 3)))
    return labels, int(count)


@pytest.mark.parametrize("seed", SEEDS)
def test_all_free_floor_is_reachable(seed: int) -> None:
    assert floors(named(seed), radius=0.2)[1] == 1


@pytest.mark.parametrize("seed", SEEDS)
def test_a_body_90_cm_wide_passes_straight_through_every_door(seed: int) -> None:
    plan, world = furnished(seed)
    assert len(plan.doors) >= sum(room.kind == "room" for room in plan.rooms)
    for door in plan.doors:
        across = np.array((0.0, 1.0)) if door.along_x else np.array((1.0, 0.0))
        way = np.array((door.x, door.y)) + np.linspace(-0.6, 0.6, 25)[:, None] * across
        assert world.clearance(way).min() >= 0.45


@pytest.mark.parametrize("seed", SEEDS)
def test_walls_are_at_least_two_cells_thick_and_close_the_building(seed: int) -> None:
    plan, _ = furnished(seed)
    for wall in plan.walls:
        assert (wall.max(axis=0) - wall.min(axis=0)).min() >= 0.1
    occupied = true_raster(named(seed)).occupied
    for border in (occupied[:2], occupied[-2:], occupied[:, :2].T, occupied[:, -2:].T):
        assert border.all()


def test_rooms_are_repeated() -> None:
    for seed in SEEDS:
        plan, _ = furnished(seed)
        widths = [round(room.width, 6) for room in plan.rooms if room.kind == "room"]
        assert max(widths.count(width) for width in widths) >= 4


def test_offices_are_furnished() -> None:
    for seed in SEEDS:
        plan, world = furnished(seed)
        assert len(world.obstacles) - len(plan.walls) >= 15
        assert all(signed_area(piece) > 0.02 for piece in world.obstacles)


def test_the_seed_decides_everything() -> None:
    assert make_world("office", 4) == named(4)
    rasters = [true_raster(named(seed), 0.1).occupied for seed in SEEDS]
    for a in SEEDS:
        for b in range(a):
            walls_of_either = rasters[a] | rasters[b]
            assert (rasters[a] & rasters[b]).sum() < 0.6 * walls_of_either.sum()


def test_seeds_give_corridors_in_both_directions() -> None:
    uprights = {bool(stream(seed, Role.WORLD).random() < 0.5) for seed in SEEDS}
    assert uprights == {True, False}


def test_an_unknown_world_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"'ofice'.*office"):
        make_world("ofice", 0)


def test_too_small_an_office_is_refused() -> None:
    with pytest.raises(ValueError, match="too small"):
        office(np.random.default_rng(0), 5.0, 5.0)
