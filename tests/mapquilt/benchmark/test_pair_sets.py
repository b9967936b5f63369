"""Lists of pairs: pixel convention, refusals, and even samples."""

import json
from collections import Counter

import numpy as np
import pytest

from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import even_sample
from tests.mapquilt.evaluation.examples import benchmark_pair
from tests.merge.literature.crisp import crisp_pair

PAIRS = [benchmark_pair(f"{k}", negative=k % 3 == 0, world=("office", "cave")[k % 2]) for k in range(60)]


def test_the_truth_in_pixels_is_the_truth_in_cells(pairs_file):
    for pair, scale in zip(read_pair_list(pairs_file), (1.0, 1.3), strict=False):
        target, source, truth = crisp_pair(scale)
        maps = pair.maps()
        assert [grid.frame.shape for grid in maps.grids] == [target.grid.frame.shape, source.grid.frame.shape]
        assert np.array_equal(maps.grids[1].occupied, source.grid.occupied)
        found = pair.metric_truth(maps)
        assert np.allclose(found.target_from_source.matrix(), truth.matrix(), atol=1e-9)
        assert found.residual_m == 0.0


def test_a_negative_has_no_truth(pairs_file):
    pair = read_pair_list(pairs_file)[2]
    assert pair.metric_truth(pair.maps()).target_from_source is None


def changed(path, entry, key, value):
    record = json.loads(path.read_text())
    if value is None:
        record["pairs"][entry].pop(key)
    else:
        record["pairs"][entry][key] = value
    return record


@pytest.mark.parametrize(
    ("entry", "key", "value", "words"),
    [
        (0, "scale", None, ("pair0", "scale, rotation_deg, tx or ty is missing")),
        (0, "scale", -1.0, ("pair0", "scale is -1")),
        (0, "tx", "far", ("tx",)),
        (1, "map_b", "gone.png", ("pair1", "gone.png", "no such file")),
        (1, "name", "pair0", ("more than one pair", "pair0")),
        (2, "kind", None, ("kind",)),
        (2, "overlap", 7.0, ("overlap",)),
    ],
)
def test_a_bad_list_is_refused_by_file_and_pair(pairs_file, tmp_path, entry, key, value, words):
    for file in pairs_file.parent.glob("*.png"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    path = tmp_path / "pairs.json"
    path.write_text(json.dumps(changed(pairs_file, entry, key, value)))
    with pytest.raises(ValueError, match=r"pairs\.json") as error:
        read_pair_list(path)
    assert all(word in str(error.value) for word in words), error.value


@pytest.mark.parametrize("number", [12, 6])
def test_every_stratum_gets_its_share(number):
    chosen = [one.info for one in even_sample(PAIRS, number, np.random.default_rng(0))]
    negative = {one.info.name for one in PAIRS if one.truth.target_from_source is None}
    shares = Counter((one.name in negative, one.world) for one in chosen)
    assert len({one.name for one in chosen}) == number
    assert shares == {
        (True, "office"): number / 6,
        (True, "cave"): number / 6,
        (False, "office"): number / 3,
        (False, "cave"): number / 3,
    }
    assert [int(one.name) for one in chosen] == sorted(int(one.name) for one in chosen)


def test_the_sample_depends_on_the_seed_alone():
    names = [[one.info.name for one in even_sample(PAIRS, 12, np.random.default_rng(seed))] for seed in (0, 0, 1)]
    assert names[0] == names[1] != names[2]


def test_a_large_limit_takes_all_and_a_limit_of_zero_is_refused():
    assert even_sample(PAIRS, 99, np.random.default_rng(0)) == PAIRS
    with pytest.raises(ValueError, match="--limit 0"):
        even_sample(PAIRS, 0, np.random.default_rng(0))
