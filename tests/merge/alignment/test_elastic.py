"""Elastic alignment: a warped map becomes sharp, a rigid one is left alone, and the equations are as stated."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from merge.alignment import elastic
from merge.alignment.elastic import bend_onto, fit_bent
from merge.preparation.prepared_map import PreparedMap
from merge.records.bend import Bend
from merge.verification.wall_overlap import measure_wall_overlap_by_tolerance
from tests.merge.rooms import observed, rooms, viewpoints

TIGHTEST = -1


@pytest.fixture(scope="module")
def grid():
    rng = np.random.default_rng(5)
    world = rooms(rng)
    return observed(world, viewpoints(world, rng, (0.3, 0.3), (15.7, 10.7), 40), Similarity2(), rng)


def arched(grid, sagitta):
    """The map, 12 cells wider on each side, its rows shifted along an arc by up to ``sagitta`` cells, mean nought."""
    values = np.pad(grid.log_odds, ((0, 0), (12, 12)))
    shift = np.rint(sagitta * (np.linspace(-1, 1, len(values)) ** 2 - 1 / 3)).astype(int)
    values = np.stack([np.roll(row, by) for row, by in zip(values, shift, strict=True)])
    return OccupancyGrid(GridFrame(grid.frame.resolution, grid.frame.origin, values.shape), values)


def scores(target, source, answer, bend=None):
    return [each.score for each in measure_wall_overlap_by_tolerance(target, source, answer, bend=bend)]


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_an_arched_map_becomes_sharp(grid, scale):
    target, source = PreparedMap(arched(grid, 9.0)), PreparedMap(grid)
    truth = Similarity2(12.0)
    if scale != 1.0:  # a source of coarser cells: every second row and column
        coarse = grid.log_odds[::2, ::2]
        source, truth = (
            PreparedMap(OccupancyGrid(GridFrame(0.1, SE2(), coarse.shape), coarse)),
            Similarity2(12.0, scale=2.0),
        )
    bend = bend_onto(target, source, truth)
    rigid, bent = scores(target, source, truth), scores(target, source, truth, bend)
    assert rigid[TIGHTEST] < 0.6
    assert bent[TIGHTEST] > 0.85
    assert 0.01 < bend.strain < 0.1


def test_a_wrong_place_stays_blurred(grid):
    prepared = PreparedMap(grid)
    wrong = Similarity2(40.0, -25.0, 0.1)
    assert scores(prepared, prepared, wrong, bend_onto(prepared, prepared, wrong))[TIGHTEST] < 0.3


def test_a_map_on_itself_does_not_bend(grid):
    prepared = PreparedMap(grid)
    bend = bend_onto(prepared, prepared, Similarity2())
    assert np.abs(bend.nodes).max() < 1e-9
    assert np.allclose(fit_bent(prepared, prepared, Similarity2(), bend, ScaleRange.free()).matrix(), np.eye(2, 3))


def test_without_common_walls_nothing_bends_and_the_transform_stays(grid):
    prepared, far = PreparedMap(grid), Similarity2(5000.0)
    bend = bend_onto(prepared, prepared, far)
    assert not bend.nodes.any()
    assert fit_bent(prepared, prepared, far, bend, ScaleRange.known()) == far


def test_the_transform_is_the_mean_over_all_parts_of_a_distorted_map(grid):
    target, source = PreparedMap(arched(grid, 9.0)), PreparedMap(grid)
    truth, start = Similarity2(12.0), Similarity2(9.0, 2.0, math.radians(0.7))
    found = fit_bent(target, source, start, bend_onto(target, source, start), ScaleRange.known())

    def off(answer):
        return np.hypot(*(answer.apply(source.points) - truth.apply(source.points)).T).mean()

    assert off(start) > 3.0
    assert off(found) < 1.0


def test_moved_furniture_does_not_move_the_walls(grid):
    """45 boxes stand elsewhere in the source."""
    rng = np.random.default_rng(8)
    cells = grid.log_odds.copy()
    free = np.argwhere(grid.free)
    for row, col in free[rng.integers(len(free), size=45)]:
        cells[row : row + 12, col : col + 12] = 2.0
    target, source = PreparedMap(grid), PreparedMap(OccupancyGrid(grid.frame, cells))
    start = Similarity2(1.0, -1.0, math.radians(0.2))
    found = fit_bent(target, source, start, bend_onto(target, source, start), ScaleRange.known())
    off = np.hypot(*(found.apply(target.points) - target.points).T).mean()
    assert off < 0.3


def dense(band):
    size, width = band.shape
    full = np.zeros((size, size))
    for i in range(size):
        for k in range(min(width, i + 1)):
            full[i, i - k] = full[i - k, i] = band[i, k]
    return full


def test_the_energy_is_the_mean_squared_strain():
    """A slow oracle: the quadratic form of the equations against the strain of the bilinear field."""
    rng = np.random.default_rng(3)
    nodes, spacing, weight = rng.normal(size=(4, 5, 2)), 7.0, 2.5
    band, right = np.zeros((nodes.size, 4 * 5 + 1)), np.zeros(nodes.size)
    elastic._add_strain(nodes, spacing, weight, band, right)
    flat = nodes.ravel()
    along_x, along_y = np.diff(nodes, axis=1) / spacing, np.diff(nodes, axis=0) / spacing
    stretch = (along_x[:-1, :, 0] ** 2 + along_x[1:, :, 0] ** 2) / 2 + (
        along_y[:, :-1, 1] ** 2 + along_y[:, 1:, 1] ** 2
    ) / 2
    shear = (along_x[:-1, :, 1] + along_x[1:, :, 1]) / 4 + (along_y[:, :-1, 0] + along_y[:, 1:, 0]) / 4
    assert flat @ dense(band) @ flat == pytest.approx(weight * (stretch + 2 * shear**2).mean())
    assert np.allclose(right, -dense(band) @ flat)  # a step to zero from here


def test_the_curvature_is_the_mean_squared_second_difference():
    rng = np.random.default_rng(4)
    nodes, spacing, weight = rng.normal(size=(4, 5, 2)), 7.0, 0.3
    band, right = np.zeros((nodes.size, 4 * 5 + 1)), np.zeros(nodes.size)
    elastic._add_curvature(nodes, spacing, weight, band, right)
    flat = nodes.ravel()
    bending = (np.diff(nodes, 2, axis=0) ** 2).sum() + (np.diff(nodes, 2, axis=1) ** 2).sum()
    assert flat @ dense(band) @ flat == pytest.approx(weight * bending / spacing**2 / 20)


def test_the_banded_solver_solves():
    rng = np.random.default_rng(6)
    size, width = 30, 7
    lower = np.tril(rng.normal(size=(size, size)))
    lower[np.subtract.outer(np.arange(size), np.arange(size)) >= width] = 0.0
    full, wanted = lower @ lower.T + np.eye(size), rng.normal(size=size)
    band = np.array([[full[i, i - k] if k <= i else 0.0 for k in range(width)] for i in range(size)])
    right = full @ wanted
    assert elastic._solve(band, right)
    assert np.allclose(right, wanted)
    assert not elastic._solve(np.array([[1.0, 0.0], [1.0, 2.0]]), np.ones(2))


def test_the_pairs_make_a_step_towards_the_target(grid):
    """Both directions pull alike: the first step moves a shifted map by most of its shift."""
    prepared, shift = PreparedMap(grid), Similarity2(2.0)
    bend = bend_onto(prepared, prepared, shift, elastic.ElasticSettings(gate_shares=(0.03,)))
    moved = (bend.apply(prepared.points) - prepared.points).mean(axis=0)
    assert moved[0] == pytest.approx(-2.0, abs=0.5)
    assert isinstance(bend, Bend)
