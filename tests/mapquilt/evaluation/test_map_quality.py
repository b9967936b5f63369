"""Quality of a merged map: known answers, in any frame."""

from __future__ import annotations

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from mapquilt.evaluation.map_quality import align_to_world, map_quality, median_pose_error, observed_part


def room(shift: int = 0, known: bool = True) -> OccupancyGrid:
    """A room of 3 x 2 m with walls of one cell of 5 cm, moved by whole cells to the right."""
    cells = np.zeros((60, 100), np.float32)
    if known:
        cells[10:50, 20 + shift : 80 + shift] = -1.0
        cells[[10, 49], 20 + shift : 80 + shift] = 1.0
        cells[10:50, [20 + shift, 79 + shift]] = 1.0
    return OccupancyGrid(GridFrame(0.05, SE2.identity(), cells.shape), cells)


def test_a_map_is_perfect_against_itself():
    found = map_quality(room(), Similarity2.identity(), room())
    assert (found.iou_free, found.precision_walls, found.recall_walls, found.f1_walls) == (1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_a_transform_is_applied_forwards(turn):
    world_from_map = Similarity2(1.0, -0.5, turn, 0.5)
    there = world_from_map.inverse()
    frame = GridFrame(0.05 / 0.5, SE2(there.x, there.y, there.yaw), (60, 100))
    perturbed = OccupancyGrid(frame, room().log_odds)
    found = map_quality(perturbed, world_from_map, room())
    assert found.iou_free > 0.97
    assert found.f1_walls > 0.99


def test_free_space_that_is_moved_counts_twice():
    free = 38 * 58
    common = 38 * (58 - 10)
    found = map_quality(room(10), Similarity2.identity(), room())
    assert found.iou_free == pytest.approx(common / (2 * free - common), abs=0.02)


@pytest.mark.parametrize(("cells", "f1"), [(0, 1.0), (2, 1.0)])
def test_a_wall_may_lie_two_cells_off(cells, f1):
    assert map_quality(room(cells), Similarity2.identity(), room()).f1_walls == pytest.approx(f1)


def test_a_wall_three_cells_off_does_not_count():
    found = map_quality(room(3), Similarity2.identity(), room())
    along, across = 2 * 60, 2 * 38
    assert found.precision_walls == pytest.approx((along - 1 * 2) / (along + across), abs=0.03)


def test_cells_outside_the_true_raster_count_against_the_map():
    far = map_quality(room(), Similarity2(100.0, 0.0, 0.0, 1.0), room())
    assert (far.iou_free, far.f1_walls) == (0.0, 0.0)


def test_a_map_of_one_half_has_half_the_recall():
    half = np.array(room().log_odds)
    half[:, 50:] = 0.0
    found = map_quality(OccupancyGrid(room().frame, half), Similarity2.identity(), room())
    assert found.precision_walls == 1.0
    assert found.recall_walls == pytest.approx(0.5, abs=0.03)
    assert found.iou_free == pytest.approx(0.5, abs=0.03)


def test_quality_is_zero_where_nothing_was_observed():
    found = map_quality(room(), Similarity2.identity(), room(known=False))
    assert (found.iou_free, found.f1_walls) == (0.0, 0.0)


def test_cells_outside_the_observed_part_count_against_the_map():
    left = np.array(room().log_odds)
    left[:, 50:] = 0.0
    truth = observed_part(room(), [OccupancyGrid(room().frame, left)])
    found = map_quality(room(), Similarity2.identity(), truth)
    assert found.recall_walls == 1.0
    assert found.iou_free == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("pose", [Similarity2(), Similarity2(3.0, -2.0, np.pi / 2, 2.0), Similarity2(-1.0, 4.0, np.pi)])
def test_alignment_finds_the_transform_of_a_perfect_merge(pose):
    there = pose.inverse()
    frame = GridFrame(0.05 / pose.scale, SE2(there.x, there.y, there.yaw), (60, 100))
    maps = MapSet(("a",), (OccupancyGrid(frame, room().log_odds),), ("m",))
    place = {"a": Similarity2()}
    found = align_to_world(maps, {"a": pose}, place)
    assert np.allclose(found.matrix(), pose.matrix(), atol=1e-9)
    assert median_pose_error(maps, {"a": pose}, place, found) == pytest.approx(0.0, abs=1e-9)
