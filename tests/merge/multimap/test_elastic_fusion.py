"""Elastic merging: a warped map merges sharper than rigidly, crisp maps are left alone, transforms stay."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.map_set import MapSet
from merge.merger import merge_maps
from merge.records.bend import Bend
from merge.records.bent_map import bent_grid
from merge.records.prior import Prior
from merge.settings import MergeSettings
from tests.merge.rooms import observed, rooms, viewpoints

RIGID = MergeSettings(trust_priors=True)
ELASTIC = MergeSettings(trust_priors=True, elastic=True)


@pytest.fixture(scope="module")
def halves() -> MapSet:
    """Two maps of one place that overlap, in one frame."""
    rng = np.random.default_rng(5)
    world = rooms(rng)
    grids = (
        observed(world, viewpoints(world, rng, low, high, 40), Similarity2(), rng)
        for low, high in (((0.3, 0.3), (11.0, 10.7)), ((5.0, 0.3), (15.7, 10.7)))
    )
    return MapSet(("a", "b"), tuple(grids), ("m", "m"), True)


@pytest.fixture(scope="module")
def warped(halves: MapSet) -> MapSet:
    """The same, the second along an arc of up to 6 cells."""
    grid = halves.grids[1].cropped(12)
    rows, cols = grid.frame.shape
    row = np.arange(0, rows + 20, 20.0)
    nodes = np.zeros((len(row), 2 + cols // 20, 2))
    nodes[..., 0] = (9.0 * ((2.0 * row / rows - 1.0) ** 2 - 1.0 / 3.0))[:, None]
    bent = Bend(np.zeros(2), 20.0, nodes).resample(grid)
    return MapSet(halves.names, (halves.grids[0], bent), halves.units, True)


def test_a_warped_map_merges_sharper_and_its_transform_stays(warped: MapSet) -> None:
    rigid, elastic = (merge_maps(warped, settings).groups[0] for settings in (RIGID, ELASTIC))
    assert elastic.rigid_conflict_cells == rigid.conflict_cells > 500
    assert elastic.conflict_cells < 0.5 * rigid.conflict_cells
    assert elastic.doubled_walls < 0.6 * rigid.doubled_walls
    assert elastic.reference_from_map == rigid.reference_from_map
    assert "b" in elastic.bends
    bend = elastic.bends["b"]
    assert 0.1 < bend.largest_bend < 0.6
    assert 0.005 < bend.strain < 0.1


def test_crisp_maps_give_the_same_bytes(halves: MapSet) -> None:
    rigid, elastic = (merge_maps(halves, settings).groups[0] for settings in (RIGID, ELASTIC))
    assert elastic.bends == {}
    assert elastic.merged.frame == rigid.merged.frame
    assert elastic.merged.log_odds.tobytes() == rigid.merged.log_odds.tobytes()
    assert elastic.conflicts.log_odds.tobytes() == rigid.conflicts.log_odds.tobytes()


def test_the_reference_and_the_order_change_only_the_frame(warped: MapSet) -> None:
    swapped = MapSet(warped.names[::-1], warped.grids[::-1], warped.units, True)
    one, other = (merge_maps(maps, ELASTIC).groups[0] for maps in (warped, swapped))
    assert (one.reference, other.reference) == ("a", "b")
    assert one.bends.keys() == other.bends.keys() != set()
    for name in one.bends:
        np.testing.assert_allclose(one.bends[name].bend.nodes, other.bends[name].bend.nodes, atol=1e-6)


def test_maps_without_common_walls_do_not_bend(warped: MapSet) -> None:
    apart = MergeSettings(trust_priors=True, elastic=True, priors=(Prior("b", 60.0, 0.0, 0.0),))
    group = merge_maps(warped, apart).groups[0]
    assert len(group.reference_from_map) == 2
    assert group.bends == {}


def test_a_map_alone_does_not_bend(warped: MapSet) -> None:
    alone = MapSet(
        ("b", "c"),
        (warped.grids[1], OccupancyGrid(warped.grids[1].frame, -np.abs(warped.grids[1].log_odds))),
        ("m", "m"),
        True,
    )
    assert all(not group.bends for group in merge_maps(alone, MergeSettings(elastic=True)).groups)


def test_cells_in_metres_scale_the_largest_bend_but_not_the_strain(warped: MapSet) -> None:
    def wider(grid: OccupancyGrid) -> OccupancyGrid:
        frame = grid.frame
        origin = type(frame.origin)(2.0 * frame.origin.x, 2.0 * frame.origin.y, frame.origin.yaw)
        return OccupancyGrid(GridFrame(2.0 * frame.resolution, origin, frame.shape), grid.log_odds)

    twice = MapSet(warped.names, tuple(map(wider, warped.grids)), warped.units, True)
    one, other = (merge_maps(maps, ELASTIC).groups[0].bends["b"] for maps in (warped, twice))
    assert other.largest_bend == pytest.approx(2.0 * one.largest_bend, rel=1e-6)
    assert other.strain == pytest.approx(one.strain, rel=1e-6)


def test_a_map_prepared_in_wider_cells_bends_alike(warped: MapSet) -> None:
    coarse = dataclasses.replace(ELASTIC, preparation=dataclasses.replace(ELASTIC.preparation, max_cells=30_000))
    one, other = (merge_maps(warped, settings).groups[0] for settings in (ELASTIC, coarse))
    assert other.conflict_cells < 0.6 * other.rigid_conflict_cells
    cells = np.argwhere(warped.grids[1].occupied)[:, ::-1] + 0.5
    moves = [each.bends["b"].bend.apply(cells) - cells for each in (one, other)]
    assert np.hypot(*(moves[0] - moves[1]).T).mean() < 1.5


def test_cells_that_leave_the_raster_are_kept() -> None:
    cells = np.full((20, 30), -1.0, np.float32)
    cells[:, 0] = 1.0
    grid = OccupancyGrid(GridFrame(0.1, SE2.identity(), cells.shape), cells)
    moved = bent_grid(grid, Bend(np.zeros(2), 40.0, np.full((2, 2, 2), -7.0)))
    assert moved.frame.shape == grid.frame.shape
    assert np.array_equal(moved.log_odds, cells)
    assert moved.frame.origin.x == pytest.approx(-0.7)
