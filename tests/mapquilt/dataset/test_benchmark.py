"""mapquilt benchmark on a data set."""

import csv
import json

import mapquilt
from mapquilt.benchmark.pair_sets import dataset_pairs
from tests.conftest import command


def test_pairs_are_those_of_the_data_set(tiny):
    pairs, data = dataset_pairs(tiny, None), mapquilt.load_dataset(tiny).pairs
    assert [pair.info.name for pair in pairs] == [one.name for one in data]
    for pair, one in zip(pairs, data, strict=True):
        nothing = one.target_from_source is None or one.overlap == 0.0
        assert pair.truth.target_from_source == (None if nothing else one.target_from_source)
        assert pair.truth.residual_m == one.residual
        assert (pair.info.subset is not None) is nothing
        assert (pair.info.mission, pair.info.noise, pair.info.world) == (one.mission, one.noise, one.world)


def test_a_split_is_run_and_missions_are_resampled(tiny, tmp_path):
    arguments = ("--dataset", tiny, "--method", "orb", "--pictures", 0)
    assert command("benchmark", *arguments, "--out", tmp_path / "all") == 0
    assert command("benchmark", *arguments, "--split", "test", "--out", tmp_path / "test") == 0
    with (tmp_path / "all/pairs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["pair"] for row in rows} == {pair.name for pair in mapquilt.load_dataset(tiny).pairs}
    summary = json.loads((tmp_path / "all/summary.json").read_text())
    assert set(summary["strata"][-1]["clustered"]) >= {"false_accepts"}
    of_split = json.loads((tmp_path / "test/summary.json").read_text())["strata"][-1]["pairs"]
    assert of_split == len(mapquilt.load_dataset(tiny, "test").pairs) < summary["strata"][-1]["pairs"]
    assert not (tmp_path / "all/sheets").exists()


def test_names_of_a_data_set_do_not_tell_its_negatives(tiny, tmp_path):
    assert command("benchmark", "export", tiny, "--out", tmp_path / "out") == 0
    record = json.loads((tmp_path / "out/export.json").read_text())
    assert {len(entry["pair"]) for entry in record["pairs"]} == {16}
    assert len(record["pairs"]) == 8
    assert command("benchmark", "export", tiny, "--split", "test", "--out", tmp_path / "out") == 0
    of_split = json.loads((tmp_path / "out/export.json").read_text())
    assert {entry["pair"] for entry in of_split["pairs"]} < {entry["pair"] for entry in record["pairs"]}
