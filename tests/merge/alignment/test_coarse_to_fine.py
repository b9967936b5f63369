import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.alignment.coarse_to_fine import refine
from merge.alignment.settings import CoarseToFineSettings
from merge.preparation.prepared_map import PreparedMap
from merge.verification.wall_overlap import measure_wall_overlap
from tests.merge.rooms import observed, rooms, viewpoints


@pytest.fixture(scope="module")
def maps():
    rng = np.random.default_rng(7)
    world = rooms(rng)
    a = observed(world, viewpoints(world, rng, (0.3, 0.3), (12.0, 10.7), 25), Similarity2(1.0, 2.0, 0.3), rng)
    b_from_world = Similarity2(-3.0, 4.0, 2.2, 1.9)
    b = observed(world, viewpoints(world, rng, (4.0, 0.3), (15.7, 10.7), 25), b_from_world, rng)
    metric = Similarity2(1.0, 2.0, 0.3) @ b_from_world.inverse()
    cells = [Similarity2.from_se2(grid.frame.origin, grid.frame.resolution) for grid in (a, b)]
    return PreparedMap(a), PreparedMap(b), cells[0].inverse() @ metric @ cells[1]


def displaced(maps, shift=8.0, turn_deg=2.0, growth=1.012):
    _, source, truth = maps
    turn = math.radians(turn_deg)
    middle = truth.apply(source.points).mean(axis=0)
    spin = Similarity2(yaw=turn, scale=growth)
    offset = middle - spin.apply(middle) + shift / math.sqrt(2.0)
    return Similarity2(*offset, turn, growth) @ truth


def off(found, maps):
    _, source, truth = maps
    return np.hypot(*(found.apply(source.points) - truth.apply(source.points)).T).mean()


@pytest.mark.parametrize(("shift", "turn", "growth"), [(8.0, 2.0, 1.012), (-8.0, -2.0, 0.988), (0.0, 0.0, 1.0)])
def test_a_start_nearby_ends_within_half_a_cell(maps, shift, turn, growth):
    start = displaced(maps, shift, turn, growth)
    found = refine(maps[0], maps[1], start, ScaleRange.free())
    assert off(found, maps) < 0.5
    assert found.scale == pytest.approx(maps[2].scale, rel=2e-3)


def test_swapping_the_maps_refines_to_the_inverse(maps):
    target, source, _ = maps
    start, all_points = displaced(maps), CoarseToFineSettings(max_points=10**6)
    there = refine(target, source, start, ScaleRange.free(), all_points)
    back = refine(source, target, start.inverse(), ScaleRange.free().inverse(), all_points)
    apart = there.apply(source.points) - back.inverse().apply(source.points)
    assert np.hypot(*apart.T).max() < 0.02  # cells


def test_a_known_scale_is_kept(maps):
    exact = maps[2].scale
    found = refine(maps[0], maps[1], displaced(maps, growth=1.0), ScaleRange(exact, exact))
    assert found.scale == pytest.approx(exact, rel=1e-12)
    assert off(found, maps) < 0.5


def test_the_scale_does_not_leave_its_range(maps):
    low, high = maps[2].scale * 1.01, maps[2].scale * 1.2
    found = refine(maps[0], maps[1], displaced(maps, growth=1.015), ScaleRange(low, high))
    assert low * (1 - 1e-12) <= found.scale <= high


def test_refining_never_lowers_the_score(maps):
    target, source, _ = maps
    rng = np.random.default_rng(1)
    for _ in range(6):
        start = Similarity2(*rng.uniform(-100, 300, 2), rng.uniform(-3, 3), rng.uniform(0.5, 1.0))
        found = refine(target, source, start, ScaleRange.free())
        before, after = (measure_wall_overlap(target, source, answer, 2000).score for answer in (start, found))
        assert after >= before - 0.0051


def test_without_any_surface_the_start_is_returned(maps):
    blank = PreparedMap(type(maps[0].grid)(maps[0].grid.frame, np.zeros_like(maps[0].grid.log_odds)))
    start = Similarity2(1.0, 2.0, 0.5)
    assert refine(maps[0], blank, start, ScaleRange.free()) == start


def test_a_bad_setting_is_named():
    with pytest.raises(ValueError, match=r"shrink is 1\.0"):
        CoarseToFineSettings(shrink=1.0)
