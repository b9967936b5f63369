"""Results on the leaderboard: written, drawn, and recomputed from their answers."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from benchmarks.leaderboard.__main__ import main
from benchmarks.leaderboard.result_file import ROOT, read_results
from benchmarks.leaderboard.table import BARS, leaderboard_picture, leaderboard_tables
from mapquilt.benchmark.files import load_answers
from tests.conftest import command
from tests.mapquilt.dataset.conftest import SPEC

DETAILS = ("--version", "0.2", "--ran-by", "a test", "--origin", "reproduced", "--date", "2026-11-27")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data set, a benchmark on it, and a leaderboard with one of its methods."""
    folder = tmp_path_factory.mktemp("leaderboard")
    (folder / "spec.yaml").write_text(SPEC.replace("duration: 1}", "duration: 12}"))
    assert command("dataset", "make", folder / "spec.yaml", "--out", folder / "data", "--workers", 1) == 0
    options = ("--method", "orb", "--pictures", 0, "--out", folder / "bench")
    assert command("benchmark", "--dataset", folder / "data", *options) == 0
    answers, data = str(folder / "board/tiny/orb.csv"), ("--dataset", str(folder / "data"))
    assert main(["answers", str(folder / "bench"), "orb", *data, "--out", answers]) == 0
    assert main(["add", answers, *data, "--method", "ORB", "--made-by", "make it", *DETAILS]) == 0
    return folder


@pytest.fixture
def board(folder: Path, tmp_path: Path) -> Path:
    """A copy of the leaderboard to change."""
    return Path(shutil.copytree(folder / "board", tmp_path / "board"))


def test_the_result_has_the_numbers_of_the_benchmark(folder: Path) -> None:
    (record,) = read_results(folder / "board").values()
    strata = {(row["group"], row["stratum"]): row for row in record["strata"]}
    summary = json.loads((folder / "bench/summary.json").read_text())
    assert record["data"]["digest"] == summary["data"]
    compared = 0
    for row in summary["strata"]:
        if row["method"] == "orb" and (row["group"], row["stratum"]) in strata:
            found = strata[row["group"], row["stratum"]]
            for name in ("right", "true_accepts", "false_accepts", "accepted_right"):
                assert (found[name] and found[name][:2]) == (row[name] and [row[name]["count"], row[name]["of"]])
            compared += 1
    assert compared == len(strata) >= 3
    seconds = sorted(one.seconds for one in load_answers(folder / "bench")[1] if one.method == "orb")
    assert seconds[0] <= record["median_s"] * 1.001 <= seconds[-1] * 1.002


def test_the_check_recomputes_what_is_at_hand_and_names_what_differs(folder, board, capsys) -> None:
    data = ("--dataset", str(folder / "data"))
    assert main(["check", "--root", str(board)]) == 0
    assert "not recomputed" in capsys.readouterr().out
    assert main(["check", "--root", str(board), *data]) == 0
    assert "orb.json: agrees" in capsys.readouterr().out
    path = board / "tiny/orb.json"
    record = json.loads(path.read_text())
    record["strata"][-1]["false_accepts"][0] += 1
    path.write_text(json.dumps(record))
    assert main(["check", "--root", str(board), *data]) == 1
    assert "every pair, all: false_accepts is [" in capsys.readouterr().out


def test_the_check_sees_changed_answers(folder, board, capsys) -> None:
    path = board / "tiny/orb.csv"
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *(re.sub(r"^(\w+),.*", r"\1,,,,,0.5,0,0.1", row) for row in rows)]))
    assert main(["check", "--root", str(board), "--dataset", str(folder / "data")]) == 1
    assert "positives, all: true_accepts is [" in capsys.readouterr().out


def test_the_picture_has_bars_of_the_shares(folder) -> None:
    (record,) = read_results(folder / "board").values()
    picture = ET.fromstring(leaderboard_picture([record | {"method": "<ORB & co>"}]))
    widths = [float(bar.get("width")) for bar in picture.iter("{http://www.w3.org/2000/svg}rect")]
    strata = {(row["group"], row["stratum"]): row for row in record["strata"]}
    shares = strata["positives", "all"]["true_accepts"], strata["every pair", "all"]["false_accepts"]
    assert widths == pytest.approx([BARS * share[0] / share[1] for share in shares], abs=0.1)
    assert "<ORB & co>" in [text.text for text in picture.iter("{http://www.w3.org/2000/svg}text")]


def test_the_table_has_a_line_for_each_result(folder) -> None:
    table = leaderboard_tables(folder / "board")
    (line,) = [line for line in table.splitlines() if line.startswith("| ORB")]
    (record,) = read_results(folder / "board").values()
    every = record["strata"][-1]["false_accepts"]
    assert line.startswith("| ORB | 0.2 |  | ")
    assert f"| {every[0]} of {every[1]} |" in line
    assert line.endswith("| reproduced by a test, 2026-11-27 |")
    assert f"digest `{record['data']['digest'][:16]}`" in table


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("origin", "hearsay", "must be one of reproduced, self-reported"),
        ("date", "yesterday", "yesterday"),
        ("version", None, "version is 'None', must be text"),
        ("schema", "mapquilt-leaderboard/9", "must be 'mapquilt-leaderboard/1'"),
        (
            "data",
            {"name": "other", "digest": "", "made_by": "", "split": None, "limit": None, "pairs": 1},
            "that of the folder",
        ),
    ],
)
def test_a_wrong_result_file_is_named(field, value, words, board) -> None:
    path = board / "tiny/orb.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {field: value}))
    with pytest.raises(ValueError, match=re.escape(words)) as error:
        read_results(board)
    assert str(path) in str(error.value)


def test_results_without_answers_or_of_other_data_are_refused(board) -> None:
    path = board / "tiny/orb.json"
    record = json.loads(path.read_text())
    record["data"]["digest"] = "0" * 64
    (board / "tiny/other.json").write_text(json.dumps(record))
    with pytest.raises(ValueError, match=r"other\.csv is missing"):
        read_results(board)
    shutil.copy(board / "tiny/orb.csv", board / "tiny/other.csv")
    with pytest.raises(ValueError, match="is about other data"):
        read_results(board)


def test_a_sample_of_the_pairs_is_that_of_the_benchmark(folder, tmp_path) -> None:
    options = ("--dataset", folder / "data", "--limit", 3)
    bench = tmp_path / "bench"
    assert command("benchmark", *options, "--method", "orb", "--pictures", 0, "--out", bench) == 0
    answers, given = str(tmp_path / "board/few/orb.csv"), [str(option) for option in options]
    assert main(["answers", str(bench), "orb", *given, "--out", answers]) == 0
    assert main(["add", answers, *given, "--method", "ORB", "--made-by", "make it", *DETAILS]) == 0
    (record,) = read_results(tmp_path / "board").values()
    assert (record["data"]["limit"], record["data"]["pairs"]) == (3, 3)
    assert record["data"]["digest"] == json.loads((bench / "summary.json").read_text())["data"]
    assert "3 pairs, drawn evenly by `--limit 3`" in leaderboard_tables(tmp_path / "board")


def test_every_published_result_is_whole() -> None:
    """All results of a data set are about the same pairs: their strata have the same sizes."""
    sizes: dict[Path, list[list[tuple[str, str, int]]]] = {}
    for path, record in read_results(ROOT).items():
        rows = [(row["group"], row["stratum"], row["pairs"]) for row in record["strata"]]
        sizes.setdefault(path.parent, []).append(rows)
        assert len(path.with_suffix(".csv").read_text().splitlines()) == record["data"]["pairs"] + 1
    assert all(rows == of_set[0] for of_set in sizes.values() for rows in of_set)
