"""Export of pairs without their truth, and answers of another program."""

from __future__ import annotations

import csv
import io
import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.io.map_file import load_map
from mapquilt.benchmark.exchange.answers import COLUMNS, TRANSFORM, read_answers
from mapquilt.benchmark.exchange.identity import by_identity, data_digest
from mapquilt.benchmark.pair_list import read_pair_list
from tests.conftest import command, hashes


@pytest.fixture(scope="module")
def export(pairs_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("export") / "out"
    assert command("benchmark", "export", "--pairs", pairs_file, "--out", out) == 0
    return out


def true_rows(pairs_file: Path) -> list[dict[str, object]]:
    """The true transform of every pair as an answer; pairs without one are refused."""
    rows = []
    for name, pair in by_identity(read_pair_list(pairs_file)).items():
        truth = pair.truth.target_from_source
        row: dict[str, object] = {"pair": name, "confidence": 0.1, "accepted": 0, "seconds": 0.5}
        if truth is not None:
            row |= {"scale": truth.scale, "rotation_deg": math.degrees(truth.yaw), "tx": truth.x, "ty": truth.y}
            row |= {"confidence": 0.9, "accepted": "true"}
        rows.append(row)
    return rows


def write_rows(path: Path, rows: list[dict[str, object]]) -> Path:
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    path.write_text(text.getvalue(), encoding="utf-8-sig")  # as spreadsheets write it: with a mark and CR LF
    return path


def test_the_export_has_the_cells_of_all_maps_and_no_truth(export, pairs_file):
    record = json.loads((export / "export.json").read_text())
    pairs = by_identity(read_pair_list(pairs_file))
    assert [entry["pair"] for entry in record["pairs"]] == sorted(pairs)
    for entry in record["pairs"]:
        assert set(entry) == {"pair", "target", "source", "resolutions_trusted"}
        pair = pairs[entry["pair"]]
        for side, file in (("target", pair.target_file), ("source", pair.source_file)):
            np.testing.assert_array_equal(
                load_map(export / entry[side]).grid.occupancy(), load_map(file).grid.occupancy()
            )
    assert {path.name for path in export.iterdir() if path.name[0] != "."} == {"export.json", "maps"}
    assert len(list((export / "maps").glob("*.yaml"))) == 4, "one map is the target of all three pairs"


def test_the_same_pairs_give_the_same_bytes_wherever_they_lie(export, pairs_file, tmp_path):
    shutil.copytree(pairs_file.parent, tmp_path / "elsewhere")
    again = tmp_path / "again"
    assert command("benchmark", "export", "--pairs", tmp_path / "elsewhere/pairs.json", "--out", again) == 0
    assert hashes(again) == hashes(export)


def test_the_digest_changes_with_truth_and_maps_alone(pairs_file):
    pairs = read_pair_list(pairs_file)
    digest = data_digest(pairs)
    assert data_digest(pairs[::-1]) == digest
    assert data_digest([replace(pair, info=replace(pair.info, suite="renamed")) for pair in pairs]) == digest
    moved = replace(pairs[0], truth=replace(pairs[0].truth, overlap=0.61))
    swapped = replace(pairs[0], source_file=pairs[1].source_file)
    assert len({digest, *(data_digest([other, *pairs[1:]]) for other in (moved, swapped))}) == 3
    with pytest.raises(ValueError, match="is the same pair as"):
        data_digest([*pairs, pairs[0]])


def test_the_truth_as_an_answer_is_right_beside_our_own_methods(pairs_file, tmp_path):
    file = write_rows(tmp_path / "oracle.csv", true_rows(pairs_file))
    out = tmp_path / "out"
    assert command("benchmark", "--pairs", pairs_file, "--method", "orb", "--answers", file, "--out", out) == 0
    with (out / "pairs.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["method"] == "oracle from answers"]
    assert [row["outcome"] for row in rows] == ["true accept", "true accept", "true reject"]
    for row in rows[:2]:
        assert float(row["rotation_deg"]) < 1e-6
        assert float(row["scale_percent"]) < 1e-6
        assert float(row["displacement_cells"]) < 1e-6
    table = (out / "table.md").read_text()
    assert "| all | oracle | answers | 2 | 100.0 (34.2 to 100.0) |" in table
    assert "| all | orb | verified | 2 |" in table
    assert list((out / "sheets").glob("oracle-from-answers-*.png"))
    summary = json.loads((out / "summary.json").read_text())
    assert summary["data"] == data_digest(read_pair_list(pairs_file))
    assert summary["methods"] == ["orb", "orb as published", "oracle from answers"]
    times = [one for one in json.loads((out / "timings.json").read_text())["pairs"] if "oracle" in one["method"]]
    assert [one["seconds"] for one in times] == [0.5] * 3


def test_answers_run_alone_under_any_name_and_without_times(pairs_file, tmp_path):
    rows = [row | {"seconds": ""} for row in true_rows(pairs_file)]
    file = write_rows(tmp_path / "a file.csv", rows)
    out = tmp_path / "out"
    assert command("benchmark", "--pairs", pairs_file, "--answers", f"mine={file}", "--out", out) == 0
    assert json.loads((out / "summary.json").read_text())["methods"] == ["mine from answers"]
    assert json.loads((out / "timings.json").read_text())["pairs"] == []
    assert command("report", out) == 0


FAULTS = {
    "has no row for pair": lambda rows: rows[1:],
    "and 1 other pair": lambda rows: rows[:1],
    "line 5: pair {0} has a row on line 2 already": lambda rows: [*rows, rows[0]],
    "line 2: pair 'pair0' is unknown": lambda rows: [rows[0] | {"pair": "pair0"}, *rows[1:]],
    "pair {0}: scale is -1, must be positive": lambda rows: [whole(rows[0]) | {"scale": -1}, *rows[1:]],
    "pair {0}: scale is 0, must be positive": lambda rows: [whole(rows[0]) | {"scale": 0}, *rows[1:]],
    "pair {0}: tx is 'nan', must be a number": lambda rows: [whole(rows[0]) | {"tx": "nan"}, *rows[1:]],
    "pair {0}: ty is '', must be a number": lambda rows: [whole(rows[0]) | {"ty": ""}, *rows[1:]],
    "pair {0}: rotation_deg is 'left'": lambda rows: [whole(rows[0]) | {"rotation_deg": "left"}, *rows[1:]],
    "tx, ty are 1e+12, 0 pixels": lambda rows: [whole(rows[0]) | {"tx": 1e12}, *rows[1:]],
    "pair {0}: confidence is 1.5, must be 0 to 1": lambda rows: [rows[0] | {"confidence": 1.5}, *rows[1:]],
    "pair {0}: accepted is 'maybe', must be 1 or 0": lambda rows: [rows[0] | {"accepted": "maybe"}, *rows[1:]],
    "pair {0}: seconds is -3, must not be negative": lambda rows: [rows[0] | {"seconds": -3}, *rows[1:]],
    "is accepted without a transform": lambda rows: [
        rows[0] | dict.fromkeys(TRANSFORM, "") | {"accepted": 1}, *rows[1:]
    ],
}  # fmt: skip


def whole(row: dict[str, object]) -> dict[str, object]:
    return row | {"scale": 1, "rotation_deg": 0, "tx": 0, "ty": 0}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_missing_doubled_or_unknown_row_is_named(fault, pairs_file, tmp_path, capsys):
    rows = true_rows(pairs_file)
    file = write_rows(tmp_path / "mine.csv", FAULTS[fault](rows))
    assert command("benchmark", "--pairs", pairs_file, "--answers", file, "--out", tmp_path / "out") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mapquilt: {file}: ")
    assert fault.format(rows[0]["pair"]) in line
    assert not (tmp_path / "out").exists()


def test_a_file_of_another_kind_is_refused(tmp_path):
    for content, words in (
        (b"pair,scale\n", "has no column 'rotation_deg'"),
        (b"\xff\xfe\x00", "byte 1 is no text of UTF-8"),
        (b"", "empty"),
    ):
        (tmp_path / "mine.csv").write_bytes(content)
        with pytest.raises(ValueError, match=words):
            read_answers(tmp_path / "mine.csv", "mine", ["a"])


def test_names_that_are_taken_or_no_names_are_refused(pairs_file, tmp_path, capsys):
    file = write_rows(tmp_path / "mine.csv", true_rows(pairs_file))
    for answers in ([f"orb={file}"], [file, f"mine={file}"], [f"../x={file}"]):
        options = [part for each in answers for part in ("--answers", each)]
        assert command("benchmark", "--pairs", pairs_file, *options, "--out", tmp_path / "out") == 2
        assert "give NAME=FILE" in capsys.readouterr().err


def test_options_before_export_are_refused(pairs_file, tmp_path, capsys):
    assert command("benchmark", "--limit", 1, "export", "--pairs", pairs_file, "--out", tmp_path / "out") == 2
    assert "--limit: has no effect before export" in capsys.readouterr().err
    assert command("benchmark", "export", "--out", tmp_path / "out") == 2
    assert "no pairs" in capsys.readouterr().err


def test_a_list_that_is_given_twice_is_refused_before_it_runs(pairs_file, tmp_path, capsys):
    twice = ("--pairs", pairs_file, "--pairs", pairs_file, "--out", tmp_path / "out")
    assert command("benchmark", *twice, "--method", "orb") == 2
    assert command("benchmark", "export", *twice) == 2
    for line in capsys.readouterr().err.splitlines():
        assert "is the same pair as" in line
    assert list(tmp_path.iterdir()) == []


def test_an_export_replaces_only_an_export(pairs_file, tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert command("benchmark", "export", "--pairs", pairs_file, "--out", tmp_path) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
