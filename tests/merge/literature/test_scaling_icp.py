import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.scaling_icp import ScalingIcp
from tests.merge.literature.crisp import blank, crisp_pair, off_share


def published(method, target, source, seed=0):
    maps = method.describe(target), method.describe(source)
    return method.published(*maps, ScaleRange.free(), np.random.default_rng(seed))


@pytest.mark.parametrize(("scale", "seed"), [(1.0, 5), (1.3, 2), (0.6, 4)])
def test_crisp_pairs_of_different_resolutions_are_found(scale, seed):
    target, source, truth = crisp_pair(scale, seed)
    answer = published(ScalingIcp(), target, source)
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.002
    assert answer.target_from_source.scale == pytest.approx(scale, rel=0.002)
    assert 0.3 <= answer.verdict.confidence <= 1.0


def test_it_converges_from_a_start_that_is_off():
    target, source, truth = crisp_pair(1.3)
    method = ScalingIcp()
    maps = method.describe(target), method.describe(source)
    start = truth @ Similarity2(3.0, -2.0, 0.03, 1.04)
    assert off_share(start, truth, source) > 0.02
    found = method.register(maps[0].edges, maps[1].edges, start)
    assert off_share(found.target_from_source, truth, source) < 0.002


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_a_start_that_collapses_a_map_needs_no_more_memory(scale):
    """RANSAC finds such a start where all matches lie together; a raster that held the moved source would not fit."""
    target, source, _ = crisp_pair()
    method = ScalingIcp()
    maps = method.describe(target), method.describe(source)
    found = method.register(maps[0].edges, maps[1].edges, Similarity2(scale=scale))
    assert scale / 1.2 <= found.target_from_source.scale <= 1.2 * scale


@pytest.mark.parametrize(("scale", "share"), [(1.0, 0.4), (0.7, 0.6), (1.6, 0.9)])
def test_the_overlap_of_points_that_match_is_their_share(scale, share):
    """Of a source whose other points lie far off, those that match up to a fraction of a cell are kept."""
    rng = np.random.default_rng(1)
    truth = Similarity2(5.0, -3.0, 0.4, scale)
    cells = rng.permutation(10_000)[:400]
    points = np.stack((cells % 100, cells // 100), axis=-1) * 2.0 + 0.5
    seen = points + rng.uniform(-0.3, 0.3, points.shape)
    number = round(share * len(points))
    seen[number:] += 300.0
    moved = truth.inverse().apply(seen)
    found = ScalingIcp().register(points[:, 0] + 1j * points[:, 1], moved[:, 0] + 1j * moved[:, 1], truth)
    assert found.overlap == pytest.approx(number / len(points), abs=0.01)
    assert np.abs(found.target_from_source.matrix() - truth.matrix()).max() < 0.1


@given(st.lists(st.floats(0.0, 100.0), min_size=3, max_size=40))
def test_the_overlap_minimises_the_objective_over_all_shares(distances):
    squares = np.sort(np.square(distances))
    method = ScalingIcp()
    number, objective = method.best_overlap(squares)
    least = max(2, int(np.ceil(method.least_overlap * len(squares))))
    tried = {n: squares[:n].mean() / (n / len(squares)) ** 3.0 for n in range(least, len(squares) + 1)}
    assert objective == pytest.approx(min(tried.values()))
    assert tried[number] == pytest.approx(objective)


def test_a_shrunk_source_gains_nothing():
    """Measured in cells of the target, a source of no size would fit best."""
    target, source, truth = crisp_pair(1.0, 5)
    method = ScalingIcp(scale_change=5.0)
    maps = method.describe(target), method.describe(source)
    found = method.register(maps[0].edges, maps[1].edges, truth @ Similarity2(scale=0.98))
    assert found.target_from_source.scale == pytest.approx(1.0, rel=0.01)


def test_proposals_keep_to_the_scale_and_to_the_place():
    target, source, truth = crisp_pair(1.3)
    method = ScalingIcp()
    maps = method.describe(target), method.describe(source)
    (proposal,) = method.propose(*maps, ScaleRange(1.25, 1.25), np.random.default_rng(0))
    assert proposal.target_from_source.scale == 1.25
    middle = source.points.mean(axis=0, keepdims=True)
    gap = proposal.target_from_source.apply(middle) - truth.apply(middle)
    assert np.abs(gap).max() < 1.0


def test_nothing_is_found_on_a_blank_map():
    target, _, _ = crisp_pair()
    method = ScalingIcp()
    maps = method.describe(target), method.describe(blank())
    assert method.propose(*maps, ScaleRange.free(), np.random.default_rng(0)) == ()
    assert published(method, target, blank()).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("least_overlap", 1.5), ("scale_change", 0.9), ("iterations", 0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        ScalingIcp(**{field: value})
