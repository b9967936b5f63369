"""Verification of data sets: no byte that a loader reads can change unnoticed, nor a record contradict another."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import mapquilt
from mapquilt.dataset.seal import seal_bytes
from mapquilt.dataset.verify import verify_dataset
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused

Lines = list[dict[str, Any]]


def reseal(folder: Path) -> None:
    """Seal a data set as it is now, so that only its records can show that they were changed."""
    names = [path.name for path in folder.iterdir() if path.suffix in (".jsonl", ".json", ".md", ".png")]
    (folder / "SHA256SUMS").write_bytes(seal_bytes({name: (folder / name).read_bytes() for name in names}))


@pytest.fixture
def copy(tiny: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(tiny, tmp_path / "copy"))


def test_the_seal_is_one_that_sha256sum_checks(tiny):
    done = subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=tiny, capture_output=True, text=True)
    assert done.returncode == 0
    sealed = ("README.md", "figures.png", "manifest.jsonl", "spec.json")
    assert done.stdout.splitlines() == [f"{name}: OK" for name in sealed]
    assert verify_dataset(tiny) == []


@pytest.mark.parametrize("name", ["README.md", "figures.png", "spec.json"])
def test_a_changed_byte_at_the_top_is_named(copy, name):
    data = bytearray((copy / name).read_bytes())
    data[random.Random(name).randrange(len(data))] ^= 1
    (copy / name).write_bytes(data)
    assert verify_dataset(copy) == [f"{name}: has changed"]


@pytest.mark.parametrize(
    ("old", "new"), [('"overlap": 0.', '"overlap": 0.0'), ('"split": "test"', '"split": "train"'), ("\n", " \n")]
)
def test_a_changed_manifest_is_refused_by_the_loader_and_named_by_verify(copy, capsys, old, new):
    text = (copy / "manifest.jsonl").read_text()
    assert old in text
    (copy / "manifest.jsonl").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=r"manifest.jsonl: has changed since the data set was made"):
        mapquilt.load_dataset(copy)
    assert command("dataset", "verify", copy) == 1
    assert "manifest.jsonl: has changed" in capsys.readouterr().out


def test_a_missing_seal_is_named(copy):
    (copy / "SHA256SUMS").unlink()
    names = ("manifest.jsonl", "spec.json", "README.md", "figures.png")
    assert verify_dataset(copy) == [f"{name}: is not vouched for by SHA256SUMS" for name in names]


def of_kind(lines: Lines, kind: str) -> Lines:
    return [line for line in lines if line["kind"] == kind]


def drop_first_sample(lines: Lines) -> None:
    lines.remove(of_kind(lines, "sample")[0])


def change(kind: str, *path: Any, to: Any) -> Callable[[Lines], None]:
    """Return a change of one field of the first record of a kind."""

    def apply(lines: Lines) -> None:
        record: Any = of_kind(lines, kind)[0]
        for part in path[:-1]:
            record = record[part]
        record[path[-1]] = to

    return apply


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda lines: lines.append(of_kind(lines, "sample")[1]), "sample 000001: is there 2 times"),
        (lambda lines: lines.append(of_kind(lines, "mission")[1]), "mission 00001: is there 2 times"),
        (lambda lines: lines.append(of_kind(lines, "other_worlds")[0]), "is there 2 times"),
        (drop_first_sample, "samples/000000: is missing, the first of 1 of 6 planned samples"),
        (change("sample", "sample", to="000077"), "samples/000077: is no sample of spec.json"),
        (change("sample", "split", to="test"), "sample 000000: is in the split test, but its mission 00000 in train"),
        (change("sample", "mission", to="00009"), "sample 000000: there is no mission 00009"),
        (change("mission", "split", to="exam"), "split exam: is none of spec.json"),
        (change("mission", "fingerprint", to="0" * 64), "missions/00000: is in another world than manifest.jsonl says"),
        (change("other_worlds", "split", to="test"), "is in the split test, but its maps in others"),
        (change("other_worlds", "target", "map", to="robot_7"), "there is no map "),
        (change("sample", "pairs", 0, "overlap", to=0.25), "the pair robot_0 and robot_1 is another in manifest.jsonl"),
        (change("sample", "pairs", 0, "identifiable", to=7 > 8), "the pair robot_0 and robot_1 is another in manifest"),
        (change("sample", "pairs", 0, "target_from_source", "yaw", to=0.5), "the pair robot_0 and robot_1 is another"),
        (change("sample", "pairs", to=[]), "the pair robot_0 and robot_1 is another in manifest.jsonl"),
        (change("sample", "maps", 1, "world_from_map", "scale", to=2.0), "samples/000000/robot_1: is another map in"),
        (change("sample", "maps", 1, "file", to="robot_0/map.yaml"), "the file of map robot_1 is robot_0/map.yaml"),
    ],
)  # fmt: skip
def test_a_wrong_record_is_named_although_it_is_sealed(copy, edit, says):
    lines = [json.loads(line) for line in (copy / "manifest.jsonl").read_text().splitlines()]
    before = json.dumps(lines)
    edit(lines)
    assert json.dumps(lines) != before
    (copy / "manifest.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    reseal(copy)
    assert any(says in problem for problem in verify_dataset(copy)), verify_dataset(copy)
    with pytest.raises(ValueError, match=r"manifest.jsonl|dataset verify"):
        mapquilt.load_dataset(copy, verify=True)


@pytest.mark.parametrize(
    "edit",
    [
        change("sample", "sample", to="../../x"),
        change("sample", "maps", 0, "name", to=".."),
        change("sample", "files", "../000001/truth.json", to="0" * 64),
        change("sample", "files", "/etc/passwd", to="0" * 64),
        change("mission", "mission", to="..\\x"),
        change("sample", "sample", to="000000\n"),
        change("sample", "pairs", 0, "overlap", to=1.5),
        change("dataset", "schema", to="mapquilt-manifest/9"),
        lambda lines: lines[1].pop("split"),
        lambda lines: lines.append(lines[0]),
        lambda lines: lines.append({"kind": "thing"}),
    ],
)
def test_a_line_that_is_not_of_the_schema_is_refused(copy, capsys, edit):
    lines = [json.loads(line) for line in (copy / "manifest.jsonl").read_text().splitlines()]
    edit(lines)
    (copy / "manifest.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    reseal(copy)
    assert "manifest.jsonl: " in refused(capsys, "dataset", "verify", copy)
    with pytest.raises(ValueError, match=r"manifest.jsonl: "):
        mapquilt.load_dataset(copy)


def test_foreign_files_and_links_are_named_and_reports_are_not(copy, tmp_path):
    (copy / "report.html").touch()
    (copy / "samples/000000/robot_0/mine.png").touch()
    (copy / "notes.txt").touch()
    (copy / "missions/link").symlink_to(tmp_path)
    assert verify_dataset(copy) == [
        f"{path}: is in no record" for path in ("missions/link", "notes.txt", "samples/000000/robot_0/mine.png")
    ]


def test_the_loader_checks_the_files_that_it_reads(copy):
    data = mapquilt.load_dataset(copy)
    mapquilt.load_dataset(copy, verify=True)
    picture = copy / "samples/000000/robot_1/map.pgm"
    picture.write_bytes(picture.read_bytes()[:-1] + b"\x00")
    (copy / "samples/000001/truth.json").write_text("{}")
    pair = next(pair for pair in data.pairs if pair.name == "000000/robot_0/robot_1")
    assert pair.target is not None
    for read in (lambda: pair.source, data.samples[0].maps):
        with pytest.raises(ValueError, match=r"robot_1/map.pgm: has changed since the data set was made"):
            read()
    with pytest.raises(ValueError, match=r"000001/truth.json: has changed"):
        data.samples[1].truth()
    with pytest.raises(ValueError, match=r"robot_1/map.pgm: has changed; .* lists 2 problems"):
        mapquilt.load_dataset(copy, verify=True)


def test_repair_removes_what_killed_writers_left(copy):
    sample = next(path for path in (copy / "samples").iterdir() if path.is_dir())
    for folder in (copy, sample):
        (folder / ".manifest.jsonl.0123456789abcdef.part").write_text("half")
    assert command("dataset", "verify", copy) == 1
    assert command("dataset", "verify", copy, "--repair") == 0
    assert not list(copy.rglob("*.part"))


@pytest.mark.parametrize(
    "verb", [("merge", "{}", "--workers", 1), ("benchmark", "--dataset", "{}", "--method", "orb", "--workers", 1)]
)
def test_verbs_check_the_maps_that_they_use(tiny: Path, tmp_path: Path, capsys, verb: tuple[object, ...]) -> None:
    """A cell of a map is another than when the data set was made; the file is still a map."""
    copy = shutil.copytree(tiny, tmp_path / "copy")
    path = copy / "samples/000000/robot_0/map.pgm"
    data = bytearray(path.read_bytes())
    data[-1] ^= 0xFE
    path.write_bytes(data)
    out = ("--out", tmp_path / "out") if verb[0] == "benchmark" else ()
    assert command(*(copy if word == "{}" else word for word in verb), *out) == 2
    assert f"{path}: has changed since the data set was made" in capsys.readouterr().err


def test_score_checks_the_truth_that_it_uses(tiny: Path, tmp_path: Path, capsys) -> None:
    copy = shutil.copytree(tiny, tmp_path / "copy")
    assert command("merge", copy, "--workers", 1) in (0, 1)
    path = copy / "samples/000000/truth.json"
    path.write_text(path.read_text() + "\n")
    assert command("score", copy, "--workers", 1) == 2
    assert f"{path}: has changed since the data set was made" in capsys.readouterr().err
