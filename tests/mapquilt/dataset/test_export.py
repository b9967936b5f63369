"""Export of data sets: every field comes back, withheld truth does not, and the libraries open it."""

from __future__ import annotations

import io
import json
import math
import sys
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image
from pyarrow import parquet

from mapping.grid.pixel_matrix import similarity_from_pixels
from mapping.io.map_file import load_map
from mapquilt.benchmark.exchange.identity import by_identity, data_digest
from mapquilt.benchmark.pair_sets import dataset_pairs
from mapquilt.benchmark.publication.rows import COLUMNS
from mapquilt.dataset.spec import SPLITS
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import refused

FORMATS = ("parquet", "webdataset", "croissant")


@pytest.fixture(scope="module")
def exports(tiny: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The tiny data set in each format, two pairs to a file, the truth of the test split withheld."""
    folder = tmp_path_factory.mktemp("exports")
    options = ("--withhold-truth", "test", "--pairs-per-file", 2)
    for name in FORMATS:
        assert command("dataset", "export", tiny, "--out", folder / name, "--format", name, *options) == 0
    return {name: folder / name for name in FORMATS}


def read_rows(folder: Path, split: str) -> list[dict[str, Any]]:
    """Read the rows of a split from its files, in order, without any code of mapquilt."""
    found: list[dict[str, Any]] = []
    for file in sorted((folder / "data").glob(f"{split}-*")):
        if file.suffix == ".tar":
            with tarfile.open(file) as shard:
                content = {name: (shard.extractfile(name) or io.BytesIO()).read() for name in shard.getnames()}
            for name, data in content.items():
                stem, _, part = name.partition(".")
                if part == "json":
                    pictures = {end: content[f"{stem}.{end}.png"] for end in ("target", "source")}
                    found.append(json.loads(data) | pictures)
        else:
            rows = parquet.read_table(file).to_pylist()
            found += [row | {end: row[end]["bytes"] for end in ("target", "source")} for row in rows]
    return found


@pytest.mark.parametrize("name", FORMATS)
def test_every_field_of_every_pair_comes_back(name: str, exports: dict[str, Path], tiny: Path) -> None:
    for split in ("train", "test"):
        pairs = by_identity(dataset_pairs(tiny, split))
        read = read_rows(exports[name], split)
        assert [row["pair"] for row in read] == list(pairs)
        for row in read:
            pair = pairs[row["pair"]]
            maps = pair.maps()
            for end, grid, file in zip(
                ("target", "source"), maps.grids, (pair.target_file, pair.source_file), strict=True
            ):
                greys = np.asarray(Image.open(io.BytesIO(row[end])))
                assert np.array_equal(greys, np.asarray(Image.open(file.with_suffix(".pgm"))))
                assert row[f"{end}_resolution"] == grid.frame.resolution == load_map(file).grid.frame.resolution
            assert row["resolutions_trusted"] is pair.resolutions_trusted
            truth, info = pair.truth, pair.info
            if split == "test":
                assert {row[column.name] for column in COLUMNS if column.truth} == {None}
                continue
            if truth.target_from_source is None:
                assert (row["kind"], row["scale"], row["tx"]) == ("negative", None, None)
            else:
                turn = math.radians(row["rotation_deg"])
                turned = row["scale"] * np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
                matrix = np.column_stack((turned, (row["tx"], row["ty"])))
                found = similarity_from_pixels(maps.grids[0].frame, matrix, maps.grids[1].frame)
                assert row["kind"] == "positive"
                assert found.matrix() == pytest.approx(truth.target_from_source.matrix(), abs=1e-9)
            assert (row["overlap"], row["identifiable"]) == (truth.overlap, truth.identifiable)
            assert (row["residual_m"], row["target_scale"]) == (truth.residual_m, truth.target_scale)
            stated = (info.name, info.subset, info.world, info.mission, info.geometry, info.noise, info.poses)
            names = ("name", "subset", "world", "mission", "geometry", "noise", "poses")
            assert tuple(row[each] for each in names) == stated


def test_withheld_truth_is_nowhere_in_the_files(exports: dict[str, Path], tiny: Path) -> None:
    pairs = dataset_pairs(tiny, "test")
    secret = {str(getattr(pair.info, name)) for pair in pairs for name in ("name", "mission", "geometry")}
    for file in (exports["webdataset"] / "data").glob("test-*"):
        assert not any(word.encode() in file.read_bytes() for word in secret if len(word) > 5)
    record = json.loads((exports["parquet"] / "shards.json").read_text())
    assert [(split["split"], split["truth"]) for split in record["splits"]] == [("train", True), ("test", False)]
    assert record["splits"][1]["digest"] == data_digest(pairs)
    assert "withheld" in (exports["parquet"] / "README.md").read_text()


def test_files_hold_two_pairs_and_the_same_bytes_again(exports: dict[str, Path], tiny: Path, tmp_path: Path) -> None:
    for name, out in exports.items():
        record = json.loads((out / "shards.json").read_text())
        for split in record["splits"]:
            count = 1 if name == "croissant" else math.ceil(split["pairs"] / 2)
            assert len(split["files"]) == count
            for entry in split["files"]:
                assert hashes(out)[entry["file"]] == entry["sha256"]
        options = ("--format", name, "--withhold-truth", "test", "--pairs-per-file", 2)
        assert command("dataset", "export", tiny, "--out", tmp_path / name, *options) == 0
        assert hashes(tmp_path / name) == hashes(out)


@pytest.mark.parametrize("name", FORMATS)
def test_the_card_names_all_files_and_the_split_to_answer(name: str, exports: dict[str, Path]) -> None:
    _, block, text = (exports[name] / "README.md").read_text().split("---\n", 2)
    metadata = yaml.safe_load(block)
    assert metadata["license"] == ["cc-by-4.0"]
    patterns = [entry["path"] for entry in metadata["configs"][0]["data_files"]]
    named = {path for pattern in patterns for path in exports[name].glob(pattern)}
    assert named == set((exports[name] / "data").iterdir())
    assert all(f"| `{column.name}` |" in text for column in COLUMNS)
    evaluation = yaml.safe_load((exports[name] / "eval.yaml").read_text())
    assert evaluation["tasks"] == [{"id": "tiny", "config": "default", "split": "test"}]
    assert (exports[name] / "croissant.json").exists() == (name == "croissant")


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_datasets_opens_the_folder(
    name: str, exports: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets", reason="reading back by Hugging Face needs datasets: the extra dev")
    loaded = datasets.load_dataset(str(exports[name]), cache_dir=str(tmp_path))
    assert set(loaded) == {"train", "test"} <= set(SPLITS)
    for split in loaded:
        for row, own in zip(loaded[split], read_rows(exports[name], split), strict=True):
            if name == "webdataset":
                row = row["json"] | {end: row[f"{end}.png"] for end in ("target", "source")}
            for column in COLUMNS:
                if column.kind == "picture":
                    greys = np.asarray(Image.open(io.BytesIO(own[column.name])))
                    assert np.array_equal(np.asarray(row[column.name]), greys)
                else:
                    assert row[column.name] == own[column.name]


@pytest.mark.slow
def test_mlcroissant_accepts_the_description_and_reads_every_record(exports: dict[str, Path]) -> None:
    mlcroissant = pytest.importorskip("mlcroissant", reason="checking Croissant needs mlcroissant: the extra dev")
    described = mlcroissant.Dataset(jsonld=str(exports["croissant"] / "croissant.json"))
    assert not described.metadata.issues.errors
    for split in ("train", "test"):
        for record, own in zip(described.records(split), read_rows(exports["croissant"], split), strict=True):
            assert record[f"{split}/pair"].decode() == own["pair"]
            assert record[f"{split}/target_resolution"] == own["target_resolution"]
            greys = np.asarray(Image.open(io.BytesIO(own["source"])))
            assert np.array_equal(np.asarray(record[f"{split}/source"]), greys)


def test_a_missing_package_and_wrong_options_are_told_in_one_line(
    tiny: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def told(*options: object, out: Path = tmp_path / "out") -> str:
        return str(refused(capsys, "dataset", "export", tiny, "--out", out, *options))

    assert "--format parkett: must be one of parquet, webdataset, croissant" in told("--format", "parkett")
    assert "has no split 'validation', only test, train" in told("--withhold-truth", "validation")
    assert "would replace the input" in told(out=tiny.parent)
    assert f"lies inside the data set {tiny}; name a folder outside it" in told(out=tiny / "hub")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("keep")
    assert "is not empty and holds no shards.json of mapquilt" in told(out=tmp_path / "mine")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "dataset export to Parquet needs pyarrow: pip install 'mapquilt[export]'" in told()
    assert not (tmp_path / "out").exists()
    assert command("dataset", "export", tiny, "--out", tmp_path / "out", "--format", "webdataset") == 0
