"""Rectangles of free space: an oracle for the list, laws, and pairs whose transform is known."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.rectangles import Rectangles, _distinct, _maximal_rectangles, _turned, wall_direction
from tests.merge.literature.crisp import blank, crisp_pair, off_share

RASTERS = st.tuples(st.integers(0, 2**32 - 1), st.integers(1, 7), st.integers(1, 7), st.floats(0.4, 0.95))


def published(target, source, scale=None):
    method = Rectangles()
    maps = method.describe(target), method.describe(source)
    return method.published(*maps, scale or ScaleRange.free(), np.random.default_rng(0))


def all_maximal(free):
    """Every rectangle of true cells that cannot grow, by trying all."""
    rows, cols = free.shape
    every = {
        (left, low, right, high)
        for left, right in combinations(range(cols + 1), 2)
        for low, high in combinations(range(rows + 1), 2)
        if free[low:high, left:right].all()
    }
    grown = [(-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)]
    return {one for one in every if not any(tuple(np.add(one, step)) in every for step in grown)}


@given(RASTERS)
def test_the_list_holds_every_maximal_rectangle_once(raster):
    seed, rows, cols, share = raster
    free = np.random.default_rng(seed).random((rows, cols)) < share
    boxes, count = _maximal_rectangles(free, 1, 500)
    found = [tuple(int(end) for end in box) for box in boxes[:count]]
    assert len(found) == len(set(found))
    assert set(found) == all_maximal(free)


@given(RASTERS)
def test_of_too_many_the_largest_are_listed(raster):
    seed, rows, cols, share = raster
    free = np.random.default_rng(seed).random((rows, cols)) < share
    boxes, count = _maximal_rectangles(free, 1, 3)
    areas = sorted(((right - left) * (high - low) for left, low, right, high in all_maximal(free)), reverse=True)
    listed = (boxes[:count, 2:] - boxes[:count, :2]).prod(axis=1)
    assert sorted(listed.tolist(), reverse=True) == areas[:3]


def test_short_rectangles_are_left_out():
    free = np.zeros((20, 20), np.bool_)
    free[2:12, 3:15] = True
    free[5:7, 15:20] = True
    boxes, count = _maximal_rectangles(free, 3, 10)
    assert boxes[:count].tolist() == [[3.0, 2.0, 15.0, 12.0]]


@pytest.mark.parametrize("degrees", [0.0, 12.3, 45.0, 89.6, 100.2])
def test_the_direction_of_walls_is_found_modulo_a_quarter_turn(degrees):
    rng = np.random.default_rng(1)
    walls = [np.stack((np.arange(200.0), np.full(200, y)), axis=-1) for y in (0.5, 60.5, 90.5)]
    walls.append(np.stack((np.full(100, 80.5), np.arange(100.0)), axis=-1))
    points = np.concatenate(walls) + rng.uniform(-0.2, 0.2, (700, 2))
    found = math.degrees(wall_direction(Similarity2(yaw=math.radians(degrees)).apply(points)))
    assert (found - degrees + 45.0) % 90.0 - 45.0 == pytest.approx(0.0, abs=0.25)


def test_four_quarters_are_a_whole_turn():
    boxes = np.array([[1.0, 2.0, 5.0, 9.0], [-3.0, -4.0, 0.0, 1.0]])
    turned = boxes
    for _ in range(4):
        turned = _turned(turned, Similarity2(yaw=math.pi / 2.0))
    np.testing.assert_allclose(turned, boxes, atol=1e-12)
    np.testing.assert_allclose(_turned(boxes[:1], Similarity2(yaw=math.pi / 2.0)), [[-9.0, 1.0, -2.0, 5.0]], atol=1e-12)


def test_rectangles_that_resemble_a_larger_one_are_left_out():
    boxes = np.array([[0.0, 0.0, 10.0, 10.0], [0.0, 0.0, 10.0, 9.0], [0.0, 0.0, 10.0, 5.0], [20.0, 0.0, 22.0, 2.0]])
    assert _distinct(boxes, 0.7, 60).tolist() == boxes[[0, 2, 3]].tolist()
    assert _distinct(boxes, 0.7, 2).tolist() == boxes[[0, 2]].tolist()


@pytest.mark.parametrize(("scale", "seed"), [(1.0, 2), (1.3, 5), (0.6, 4)])
def test_crisp_pairs_of_any_scale_are_found(scale, seed):
    target, source, truth = crisp_pair(scale, seed)
    answer = published(target, source)
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.005
    assert answer.target_from_source.scale == pytest.approx(scale, rel=0.01)


def test_a_known_scale_is_kept():
    target, source, truth = crisp_pair(1.3, 5)
    answer = published(target, source, ScaleRange(1.3, 1.3))
    assert answer.target_from_source.scale == pytest.approx(1.3)
    assert off_share(answer.target_from_source, truth, source) < 0.005
    wrong = published(target, source, ScaleRange(0.9, 1.0))
    assert 0.9 <= wrong.target_from_source.scale <= 1.0
    assert not wrong.verdict.accepted


def test_maps_of_two_buildings_are_refused():
    target, source = crisp_pair(1.0, 2)[0], crisp_pair(1.0, 8)[1]
    answer = published(target, source)
    assert not answer.verdict.accepted
    assert "the number of matched rectangles is" in str(answer.verdict.refusal)


def test_nothing_is_found_without_walls():
    target, _, _ = crisp_pair()
    method = Rectangles()
    for other in (blank(), blank(3, 5)):
        maps = method.describe(target), method.describe(other)
        assert method.propose(*maps, ScaleRange.free(), np.random.default_rng(0)) == ()
        assert published(target, other).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("median_cells", 4), ("alike", 1.5), ("kept", 0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        Rectangles(**{field: value})
