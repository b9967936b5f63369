import dataclasses
import math

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.preparation.prepared_map import PreparedMap
from merge.preparation.settings import PreparationSettings
from merge.preparation.surface import nearest_point
from merge.verification.wall_overlap import measure_wall_overlap, tolerance_cells
from tests.merge.rooms import observed, rooms, viewpoints


def prepare(values):
    values = np.asarray(values)
    return PreparedMap(OccupancyGrid.from_occupancy(GridFrame(1.0, SE2(), values.shape), values))


def room(shape=(60, 80), wall=3):
    values = np.full(shape, 100)
    values[wall:-wall, wall:-wall] = 0
    return values


SAME = Similarity2.identity()


def test_the_surface_is_in_the_first_occupied_cells_with_normals_to_free_space():
    found = prepare(room())
    low = found.points[np.abs(found.points[:, 0] - 40.5) < 0.1]
    assert sorted(low[:, 1].tolist()) == pytest.approx([2.5, 57.5])
    upward = found.normals[np.hypot(*(found.points - (40.5, 2.5)).T).argmin()]
    assert upward == pytest.approx((0.0, 1.0))


@pytest.mark.parametrize("axis", [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_the_nearest_surface_that_faces_a_way_is_that_of_an_exhaustive_search(axis):
    rng = np.random.default_rng(0)
    values = rng.choice([100, 0, -1], (30, 40), p=[0.03, 0.8, 0.17])
    found = prepare(values)
    members = found.points[(found.normals @ axis > PreparationSettings.sector_cosine) | ~found.normals.any(axis=1)]
    for x, y in rng.uniform((-1, -1), (41, 31), (100, 2)):
        _, distance = nearest_point(found.surface, x, y, *map(float, axis))
        exhaustive = np.hypot(*(np.array([x, y]) - members).T).min()
        assert exhaustive - 1e-12 <= distance <= exhaustive + 1.5  # cells are asked, not points


def test_both_sides_of_a_wall_thinner_than_the_tolerance_find_their_own():
    values = np.zeros((200, 300), dtype=int)
    values[100:102, 20:280] = 100
    thin = prepare(values)
    assert tolerance_cells(thin, thin, 1.0) > 2.0
    walls = measure_wall_overlap(thin, thin, Similarity2(0.0, 1.5))
    assert walls.inlier_length > 0.95 * len(thin.points)
    assert walls.opposed_length == 0.0


def test_a_map_on_itself_has_full_overlap():
    walls = measure_wall_overlap(prepare(room()), prepare(room()), SAME)
    assert walls.inlier_length == len(prepare(room()).points)
    assert (walls.opposed_length, walls.violation_length) == (0.0, 0.0)
    assert walls.score == 1.0


def test_a_room_half_as_large_stands_in_free_space():
    inner = room((30, 40))
    walls = measure_wall_overlap(prepare(room()), prepare(inner), Similarity2(20.0, 15.0))
    assert walls.inlier_length == 0.0
    assert walls.violation_length > 0.4 * len(prepare(inner).points)


def test_a_wall_seen_from_the_other_side_does_not_count_as_the_same():
    from_below, from_above = np.full((40, 60), -1), np.full((40, 60), -1)
    from_below[:20], from_below[20:22] = 0, 100
    from_above[22:], from_above[20:22] = 0, 100
    walls = measure_wall_overlap(prepare(from_below), prepare(from_above), Similarity2(0.0, -2.0))
    assert walls.inlier_length == 0.0
    assert walls.opposed_length == pytest.approx(60.0)  # each wall stands in the other's free space
    both_sides = measure_wall_overlap(prepare(from_below), prepare(from_above), Similarity2(0.0, -1.0))
    assert (both_sides.inlier_length, both_sides.opposed_length) == (0.0, 0.0)


def test_parallel_walls_have_no_normal_isotropy_and_a_square_room_has_most():
    corridor = np.zeros((30, 90), dtype=int)
    corridor[:3] = corridor[-3:] = 100
    assert measure_wall_overlap(prepare(corridor), prepare(corridor), SAME).normal_isotropy == pytest.approx(
        0.0, abs=0.01
    )  # its open ends
    upright = prepare(np.rot90(corridor, -1))
    turned = measure_wall_overlap(upright, prepare(corridor), Similarity2(30.0, 0.0, math.pi / 2))
    assert turned.score == pytest.approx(1.0) and turned.normal_isotropy == pytest.approx(0.0, abs=0.01)
    square = prepare(room((60, 60)))
    assert measure_wall_overlap(square, square, SAME).normal_isotropy == pytest.approx(0.5)


def test_swapping_the_maps_gives_the_same_lengths():
    rng = np.random.default_rng(1)
    world = rooms(rng)
    first = Similarity2(3.0, -1.0, 0.4)
    second = Similarity2(0.0, 9.0, -2.0, 1.6)
    a = PreparedMap(observed(world, viewpoints(world, rng, (0.3, 0.3), (11.0, 10.7), 15), first, rng))
    b = PreparedMap(observed(world, viewpoints(world, rng, (5.0, 0.3), (15.7, 10.7), 15), second, rng))
    metre_from_cell = [Similarity2.from_se2(c.grid.frame.origin, c.grid.frame.resolution) for c in (a, b)]
    truth = metre_from_cell[0].inverse() @ first @ second.inverse() @ metre_from_cell[1]
    there = Similarity2(2.0, -1.0, 0.01) @ truth
    one = dataclasses.asdict(measure_wall_overlap(a, b, there))
    other = dataclasses.asdict(measure_wall_overlap(b, a, there.inverse()))
    assert one == pytest.approx(other, rel=1e-3)
    assert one["inlier_length"] > 0.0


def test_the_tolerance_is_one_and_a_half_cells_of_the_coarser_map_or_a_share_of_the_smaller():
    small, large = prepare(np.zeros((30, 40))), prepare(np.zeros((300, 400)))
    assert tolerance_cells(small, small, 1.0) == 1.5
    assert tolerance_cells(small, small, 2.0) == 3.0
    assert tolerance_cells(large, large, 1.0) == pytest.approx(7.0)
    assert tolerance_cells(small, large, 0.2) == 1.5
    assert tolerance_cells(large, large, 0.5) == pytest.approx(0.5 * tolerance_cells(large, large, 2.0))


def test_blank_maps_have_no_overlap():
    walls = measure_wall_overlap(prepare(np.full((5, 5), -1)), prepare(np.zeros((1, 1))), SAME)
    assert walls.score == 0.0 and walls.compared_length == 0.0 and not math.isnan(walls.normal_isotropy)
