import math

import numpy as np
import pytest

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from merge.literature.genetic import Genetic, Likelihood, consistency, likelihood
from merge.literature.poses import matrices
from tests.merge.literature.crisp import blank, crisp_pair, off_share


def test_walls_are_likely_free_cells_are_not_and_unknown_ones_lie_between():
    occupied, free = np.zeros((1, 9), bool), np.zeros((1, 9), bool)
    occupied[0, 0], free[0, 1:5] = True, True
    field = likelihood(occupied, free, 2.0)[0]
    near = np.exp(-0.5 * (np.arange(9) / 2.0) ** 2)
    assert field[0] == 1.0
    assert field[1:5] == pytest.approx(2 * near[1:5] - 1, abs=1e-6)
    assert field[5:] == pytest.approx(near[5:], abs=1e-6)


def test_consistency_by_a_slow_sum():
    rng = np.random.default_rng(1)
    field = rng.uniform(-1, 1, (20, 30)).astype(np.float32)
    walls = rng.uniform(0, 15, (8, 2))
    source = Likelihood((field,), walls, walls.mean(axis=0))
    poses = np.column_stack((rng.uniform(-5, 35, 12), rng.uniform(-5, 25, 12), rng.uniform(-3, 3, 12)))
    slow = []
    for matrix in matrices(poses, source.middle, 1.2):
        total = 0.0
        for x, y in Similarity2.from_matrix(matrix).apply(walls):
            if 0 <= math.floor(x) < 30 and 0 <= math.floor(y) < 20:
                total += field[math.floor(y), math.floor(x)]
        slow.append(total / 8)
    assert consistency(field, source, poses, 1.2) == pytest.approx(slow, abs=1e-6)


def test_the_fittest_individual_survives():
    target, source, _ = crisp_pair()
    method, rng = Genetic(), np.random.default_rng(0)
    there, here = method.describe(target), method.describe(source)
    poses = method._newborn(there.fields[0], rng, 60)
    best = [consistency(there.fields[0], here, poses, 1.0).max()]
    for _ in range(12):
        poses = method._next(there.fields[0], here, poses, 1.0, np.array([10.0, 10.0, 0.1]), rng)
        assert len(poses) == 60
        best.append(consistency(there.fields[0], here, poses, 1.0).max())
    assert best == sorted(best)
    assert best[-1] > best[0]


@pytest.mark.parametrize("seed", [2, 6])
def test_a_crisp_pair_of_one_scale_is_found_and_accepted(seed):
    target, source, truth = crisp_pair(1.0, seed)
    method = Genetic()
    maps = method.describe(target), method.describe(source)
    answer = method.published(*maps, ScaleRange.known(), np.random.default_rng(0))
    assert answer.verdict.accepted
    assert off_share(answer.target_from_source, truth, source) < 0.005


def test_the_result_depends_on_the_seed():
    target, source, _ = crisp_pair()
    method = Genetic(individuals=30, generations=6, proposals=4)
    maps = method.describe(target), method.describe(source)
    found = [method.propose(*maps, ScaleRange.known(), np.random.default_rng(seed)) for seed in (0, 0, 1)]
    assert found[0] == found[1] != found[2]
    assert len(found[0]) == 4


def test_nothing_is_found_without_walls():
    target, _, _ = crisp_pair()
    method = Genetic()
    maps = method.describe(target), method.describe(blank())
    assert method.propose(*maps, ScaleRange.known(), np.random.default_rng(0)) == ()
    assert method.published(*maps, ScaleRange.known(), np.random.default_rng(0)).target_from_source is None


@pytest.mark.parametrize(("field", "value"), [("individuals", 0), ("consistency", 0.0), ("blurs_cells", ())])
def test_a_bad_setting_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} is "):
        Genetic(**{field: value})
