"""mapquilt benchmark on a data set."""

import csv
import json

import mapquilt
from mapquilt.benchmark.dataset_pairs import dataset_pairs
from tests.conftest import command


def test_pairs_are_those_of_the_data_set(tiny):
    pairs, data = dataset_pairs(tiny, None), mapquilt.load_dataset(tiny).pairs
    assert [pair.name for pair in pairs] == [one.name for one in data]
    for pair, one in zip(pairs, data, strict=True):
        nothing = one.target_from_source is None or one.overlap == 0.0
        assert (pair.truth is None) is nothing
        assert nothing or pair.target_from_source(pair.maps()) == one.target_from_source
        assert (pair.subset is not None) is nothing
        assert (pair.mission, pair.noise, pair.world) == (one.mission, one.noise, one.world)


def test_what_bends_too_much_is_told_from_the_residual(tiny):
    pair = next(pair for pair in dataset_pairs(tiny, None) if pair.truth is not None and pair.fitted)
    maps = pair.maps()
    grid = maps.grids[0]
    rows, cols = grid.known.any(axis=1).nonzero()[0], grid.known.any(axis=0).nonzero()[0]
    diagonal = grid.frame.resolution * ((rows[-1] - rows[0] + 1) ** 2 + (cols[-1] - cols[0] + 1) ** 2) ** 0.5
    half = 0.015 * diagonal * pair.target_scale / 2
    told = {share: type(pair)(**{**vars(pair), "residual": share * half}) for share in (0.99, 1.01)}
    assert not told[0.99].bent(maps)
    assert told[1.01].bent(maps)
    assert type(pair)(**{**vars(pair), "residual": None, "fitted": False}).bent(maps)


def test_a_split_is_run_and_missions_are_drawn_again(tiny, tmp_path):
    arguments = ("--dataset", tiny, "--method", "orb", "--pictures", 0)
    assert command("benchmark", *arguments, "--out", tmp_path / "all") == 0
    assert command("benchmark", *arguments, "--split", "test", "--out", tmp_path / "test") == 0
    with (tmp_path / "all/pairs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["pair"] for row in rows} == {pair.name for pair in mapquilt.load_dataset(tiny).pairs}
    summary = json.loads((tmp_path / "all/summary.json").read_text())
    assert set(summary["strata"][-1]["over_missions"]) == {"wrong_accepts"}
    of_split = json.loads((tmp_path / "test/summary.json").read_text())["strata"][-1]["pairs"]
    assert of_split == len(mapquilt.load_dataset(tiny, "test").pairs) < summary["strata"][-1]["pairs"]
    assert not (tmp_path / "all/sheets").exists()
