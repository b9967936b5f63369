"""Lists of pairs: the convention of pixels, and what is refused."""

import json

import numpy as np
import pytest

from mapquilt.benchmark.pair_file import read_pairs
from tests.merge.literature.crisp import crisp_pair


def test_the_truth_in_pixels_is_the_truth_in_cells(pairs_file):
    for pair, scale in zip(read_pairs(pairs_file), (1.0, 1.3), strict=False):
        target, source, truth = crisp_pair(scale)
        maps = pair.maps()
        assert [grid.frame.shape for grid in maps.grids] == [target.grid.frame.shape, source.grid.frame.shape]
        assert np.array_equal(maps.grids[1].occupied, source.grid.occupied)
        assert np.allclose(pair.target_from_source(maps).matrix(), truth.matrix(), atol=1e-9)
        assert not pair.bent(maps)


def test_a_negative_has_no_truth(pairs_file):
    pair = read_pairs(pairs_file)[2]
    assert pair.target_from_source(pair.maps()) is None


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
        (0, "scale", None, ("pair0", "needs scale")),
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
        read_pairs(path)
    assert all(word in str(error.value) for word in words), error.value
