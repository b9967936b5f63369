"""mapquilt dataset disturb, from a data set to a benchmark."""

import csv
import json

import numpy as np
import pytest

from mapping.io.map_file import load_map
from mapquilt.benchmark.pair_list import read_pair_list
from mapquilt.benchmark.pair_sets import dataset_pairs
from tests.conftest import command, hashes


@pytest.fixture(scope="module")
def made(tiny, tmp_path_factory):
    """Three pairs, disturbed by two kinds; not to be written to."""
    out = tmp_path_factory.mktemp("disturbed") / "out"
    arguments = ["dataset", "disturb", tiny, "--kind", "specks", "--kind", "warp-2", "--overlap", "0:1", "--limit", 3]
    assert command(*arguments, "--out", out) == 0
    return out, arguments


def test_three_pairs_come_back_with_all_that_is_known_of_them(made, tiny):
    before = {pair.info.name: pair for pair in dataset_pairs(tiny, None)}
    pairs = read_pair_list(made[0] / "pairs.json")
    assert len(pairs) == 3
    assert {pair.info.subset for pair in pairs} == {"specks", "warp-2"}
    for pair in pairs:
        old = before[pair.info.name]
        assert (pair.info.mission, pair.info.noise, pair.info.poses) == (
            old.info.mission,
            old.info.noise,
            old.info.poses,
        )
        assert pair.info.world == "office"
        assert pair.truth.target_scale == old.truth.target_scale
        assert pair.resolutions_trusted == old.resolutions_trusted
        maps = pair.maps()
        true, old_true = pair.metric_truth(maps), old.truth
        assert (true.target_from_source is None) == (old_true.target_from_source is None)
        if true.target_from_source is None:
            continue
        assert true.identifiable
        if pair.info.subset == "specks":
            assert np.allclose(true.target_from_source.matrix(), old_true.target_from_source.matrix(), atol=1e-6)
            assert true.residual_m == old_true.residual_m
            assert true.overlap == pytest.approx(old_true.overlap, abs=1e-9)  # no cell is lost
        else:
            assert true.target_from_source.scale == pytest.approx(old_true.target_from_source.scale)
            assert true.residual_m > old_true.residual_m
        assert np.array_equal(maps.grids[0].log_odds, load_map(old.target_file).grid.log_odds)


def test_a_benchmark_runs_on_them(made, tmp_path):
    assert command("benchmark", "--pairs", made[0] / "pairs.json", "--method", "orb", "--out", tmp_path / "bench") == 0
    with (tmp_path / "bench/pairs.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["method"] == "orb"]
    assert len(rows) == 3
    assert {row["subset"] for row in rows} == {"specks", "warp-2"}
    entries = {one["name"]: one for one in json.loads((made[0] / "pairs.json").read_text())["pairs"]}
    for row in rows:
        assert row["world"] == "office"
        residual = entries[row["pair"]]["residual_m"]
        assert row["residual_m"] == ("" if residual is None else str(residual))


def test_the_same_seed_gives_the_same_bytes(made, tmp_path):
    assert command(*made[1], "--out", tmp_path / "again") == 0
    assert hashes(tmp_path / "again") == hashes(made[0])
    assert command(*made[1], "--seed", 1, "--out", tmp_path / "other") == 0
    assert hashes(tmp_path / "other") != hashes(made[0])
    (tmp_path / "other/notes.txt").write_text("mine")
    assert command(*made[1], "--out", tmp_path / "other") == 0
    assert (tmp_path / "other/notes.txt").read_text() == "mine"
    (tmp_path / "other/notes.txt").unlink()
    assert hashes(tmp_path / "other") == hashes(made[0])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--kind", "warp-9"), "--kind warp-9: must be one of warp-1"),
        (("--overlap", "0.999:1"), "has no pair with overlap 0.999:1"),
        (("--overlap", "much"), "--overlap much: must be LO:HI"),
        (("--limit", "0"), "--limit 0: must be at least 1"),
        (("--split", "validation"), "validation"),
    ],
)
def test_what_cannot_be_disturbed_is_refused(tiny, tmp_path, capsys, options, words):
    overlap = () if "--overlap" in options else ("--overlap", "0:1")
    assert command("dataset", "disturb", tiny, "--out", tmp_path / "out", *overlap, *options) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_folder_of_others_is_left_alone(tiny, tmp_path, capsys):
    (tmp_path / "pairs.json").write_text('{"pairs": []}')
    assert command("dataset", "disturb", tiny, "--overlap", "0:1", "--out", tmp_path) == 2
    assert f"{tmp_path}: is not empty and holds no pairs that mapquilt wrote" in capsys.readouterr().err
    assert (tmp_path / "pairs.json").read_text() == '{"pairs": []}'
