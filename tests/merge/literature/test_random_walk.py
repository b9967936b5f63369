import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.poses import inverses, matrices
from merge.literature.random_walk import RandomWalk, _steps, cell_distances, manhattan
from tests.merge.literature.crisp import blank, crisp_pair, off_share


def nearest(mask, row, col):
    """Manhattan distance to the nearest set cell, by looking at all."""
    return min(abs(row - r) + abs(col - c) for r, c in np.argwhere(mask))


@pytest.fixture(scope="module")
def mask():
    return np.random.default_rng(0).random((9, 13)) < 0.06


def test_the_distance_map_equals_brute_force(mask):
    slow = [[nearest(mask, row, col) for col in range(13)] for row in range(9)]
    assert np.array_equal(manhattan(mask), slow)


def test_distances_of_moved_points_within_and_beyond_the_raster(mask):
    points = np.random.default_rng(1).uniform(0.0, 10.0, (15, 2))
    moves = [Similarity2(), Similarity2(-30.0, 4.0, 1.0), Similarity2(15.0, 40.0, -2.0, 1.7)]
    distances = np.stack((manhattan(mask), manhattan(~mask)), axis=-1)
    for value, cells_of_value in enumerate((mask, ~mask)):
        means, agree, disagree = cell_distances(distances, value, points, np.array([move.matrix() for move in moves]))
        for k, move in enumerate(moves):
            cells = np.floor(move.apply(points)).astype(int)
            slow = [nearest(cells_of_value, row, col) for col, row in cells]
            other = [nearest(~cells_of_value, row, col) for col, row in cells]
            assert means[k] == pytest.approx(np.mean(slow))
            assert agree[k] == pytest.approx(np.mean(np.equal(slow, 0)))
            assert disagree[k] == pytest.approx(np.mean(np.equal(other, 0)))


def test_poses_place_the_middle_and_have_inverses():
    poses = np.array([(3.0, -4.0, 0.5), (100.0, 7.0, -2.0)])
    middle, size = np.array([11.0, 22.0]), 1.4
    forward = matrices(poses, middle, size)
    assert np.allclose(forward[:, :, :2] @ middle + forward[:, :, 2], poses[:, :2])
    for matrix, back in zip(forward, inverses(forward), strict=True):
        both = Similarity2.from_matrix(matrix) @ Similarity2.from_matrix(back)
        assert np.allclose(both.matrix(), Similarity2().matrix())


def test_the_similarity_of_a_map_with_itself_is_best_at_the_identity():
    _, source, _ = crisp_pair()
    method = RandomWalk()
    valued = method.describe(source)
    offsets = np.array([(0.0, 0, 0), (3, 0, 0), (0, -3, 0), (0, 0, 0.05), (40, 20, 0), (0, 0, math.pi)])
    costs = method.dissimilarity(valued, valued, np.append(valued.middle, 0.0) + offsets, 1.0)
    assert costs[0] == pytest.approx(-method.lock_cells)  # psi is 0, and every cell agrees
    assert (np.diff(costs[[0, 1, 4]]) > 0).all()
    assert costs[0] < costs[1:].min()


def test_steps_are_drawn_from_mean_and_covariance_of_the_last_ones():
    rng = np.random.default_rng(3)
    memory = rng.standard_normal((6, 1, 3)) * (5.0, 9.0, 2.0) + (20.0, 0.0, -3.0)
    drawn = np.array([_steps(memory, (0.4, 0.4, 0.003), rng)[0] for _ in range(20_000)])
    assert np.allclose(drawn.mean(axis=0), memory.mean(axis=(0, 1)), atol=0.2)
    expected = np.cov(memory[:, 0].T, bias=True) + np.diag([0.4**2, 0.4**2, 0.003**2])
    assert np.allclose(np.cov(drawn.T), expected, rtol=0.1, atol=0.5)


def test_a_crisp_pair_of_one_scale_is_found():
    target, source, truth = crisp_pair(1.0, 6)
    method = RandomWalk(acceptance_index=0.95)
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange.known(), np.random.default_rng(0))
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.01


def test_the_result_depends_on_the_seed_and_every_walk_proposes():
    target, source, _ = crisp_pair()
    method = RandomWalk(walks=5, steps=30)
    maps = method.describe(target), method.describe(source)
    found = [method.propose(*maps, ScaleRange.known(), np.random.default_rng(seed)) for seed in (0, 0, 1)]
    assert found[0] == found[1] != found[2]
    assert len(found[0]) == 5


def test_nothing_is_found_without_walls():
    target, _, _ = crisp_pair()
    method = RandomWalk()
    maps = method.describe(target), method.describe(blank())
    assert method.propose(*maps, ScaleRange.known(), np.random.default_rng(0)) == ()
    assert method.published(*maps, ScaleRange.known(), np.random.default_rng(0)).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("walks", 0), ("lock_cells", -1.0), ("acceptance_index", 0.0)])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is {value}"):
        RandomWalk(**{field: value})
