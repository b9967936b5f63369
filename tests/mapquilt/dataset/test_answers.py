"""Merge and score over a whole data set, and its reading by numpy alone."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.geometry.similarity2 import Similarity2
from mapquilt.dataset.answers import ScoredSample, wrong_verdicts
from mapquilt.dataset.loader import load_dataset
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.json_file import read_record
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused
from tests.mapquilt.evaluation.examples import GOOD


@pytest.mark.slow
def test_all_samples_are_merged_and_scored_in_place(
    tiny: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = tmp_path / "data"
    shutil.copytree(tiny, data)
    assert "no sample is merged" in refused(capsys, "score", data)
    assert command("merge", data, "--workers", 2) in (0, 1)
    assert "6 samples merged in place" in " ".join(capsys.readouterr().out.split())
    assert command("score", data, "--workers", 1) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    (every,) = [row[1:] for row in rows if row[:1] == ["all"]]
    summaries = [read_record(sample.folder / "score.json", "score")["summary"] for sample in load_dataset(data).samples]
    names = ("pairs", "true_accepts", "false_accepts", "false_rejects", "true_rejects")
    assert [int(number) for number in every] == [sum(each[name] for each in summaries) for name in names]
    assert command("dataset", "verify", data) == 0
    alone = tmp_path / "alone"
    shutil.copytree(tiny / "samples/000000", alone / "samples/000000")
    shutil.copytree(tiny / "missions", alone / "missions")
    assert command("merge", alone / "samples/000000") in (0, 1)
    for name in ("merge.json", "transforms.yaml"):
        assert (alone / "samples/000000" / name).read_bytes() == (data / "samples/000000" / name).read_bytes()


def test_wrong_verdicts_are_listed_with_sample_and_reason() -> None:
    wrong = replace(GOOD, displacement_m=0.5, rotation_deg=10.0)
    info = PairInfo("a and b", "a", "b")
    somewhere = GroundTruth(Similarity2(), residual_m=0.0)
    pairs = (
        EvaluatedPair(info, somewhere, accepted=False, reason="ambiguous", right=True),
        EvaluatedPair(info, somewhere, accepted=True, error=wrong),
        EvaluatedPair(info, GroundTruth(None), accepted=True),
        EvaluatedPair(info, somewhere, accepted=True, right=True),
    )
    assert wrong_verdicts([ScoredSample("000007", "test", pairs)]) == (
        "000007: a <- b: false accept: off by 0.50 m, 10.0 deg",
        "000007: a <- b: false accept, no common ground",
        "000007: a <- b: false reject: ambiguous",
        "no common ground: the maps show no place that both robots saw, and had to be refused",
    )


def test_options_of_single_merges_are_refused(tiny: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "is a data set, to which" in refused(capsys, "merge", tiny, "--out", tmp_path / "merged")


def test_the_recipe_of_the_card_reads_the_pairs_by_numpy_alone(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    card = (tiny / "README.md").read_text(encoding="utf-8")
    recipe = re.search(r"Without mapquilt.*?\n\n((?:    .*\n|\n)+)", card, re.DOTALL)
    assert recipe is not None
    code = re.sub(r"^    ", "", recipe[1], flags=re.MULTILINE)
    assert "mapquilt" not in code
    found: list[Any] = []
    monkeypatch.chdir(tiny)
    exec(code + "        found.append((target, source, matrix))\n", {"found": found})
    pairs = [pair for pair in load_dataset(tiny).pairs if pair.target_from_source is not None]
    assert len(found) == len(pairs) > 0
    for (target, source, matrix), pair in zip(found, pairs, strict=True):
        assert np.array_equal(target == 0, pair.target.occupied)
        assert np.array_equal(source == 254, pair.source.free)
        true = pair.target_from_source
        assert true is not None
        points = np.array([(0.0, 0.0), (3.0, -2.0)])
        assert np.allclose((points @ matrix[:2, :2].T) + matrix[:2, 2], true.apply(points))
