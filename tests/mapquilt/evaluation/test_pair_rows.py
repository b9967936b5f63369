"""Rows of evaluated pairs: exact round trips, and rows of version 1 are still read."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from pathlib import Path

import pytest

from mapping.geometry.similarity2 import Similarity2
from mapquilt.evaluation.pair_rows import COLUMNS, csv_text, from_row, read_csv_row, to_row
from mapquilt.study.files import trials_from_record
from merge.records.evidence import Evidence
from merge.records.pair_answer import Alternative
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated

EVIDENCE = Evidence(0.9, 0.95, 0.03, 0.01, 2e4, 0.5, 4.0, 900.0, 0.4, 0.7, 0.3, 1.0, None, None, 3)
PAIRS = [
    evaluated(True, GOOD, 0.9, overlap=0.5, evidence=EVIDENCE, answer=Similarity2(1.0, 2.0, 0.5, 1.1), noise=1.0),
    evaluated(False, BAD, 0.1, identifiable=False, reason="too little overlap", level=("1", "odometry"), world="12"),
    evaluated(False, None, 0.0, negative=True, mission="007", distorted=None),
]


def with_alternative(one):
    return dataclasses.replace(one, alternative=Alternative(Similarity2(3.0), 0.25), seconds=None)


@pytest.mark.parametrize("one", [with_alternative(PAIRS[0]), *(dataclasses.replace(p, seconds=None) for p in PAIRS)])
def test_a_row_of_json_gives_the_same_pair(one):
    assert from_row(json.loads(json.dumps(to_row(one)))) == one


@pytest.mark.parametrize("one", [with_alternative(PAIRS[0]), dataclasses.replace(PAIRS[2], seconds=None)])
def test_a_row_of_csv_gives_the_same_pair(one):
    (row,) = csv.DictReader(io.StringIO(csv_text([to_row(one)])))
    assert from_row(read_csv_row(row)) == one


def test_map_files_are_relative_to_the_folder(tmp_path):
    one = evaluated(True, GOOD, target_file=tmp_path / "maps/a.yaml", source_file=tmp_path / "b.yaml")
    row = to_row(one, tmp_path)
    assert (row["target_map"], row["source_map"]) == ("maps/a.yaml", "b.yaml")
    assert from_row(row, tmp_path).pair.target_file == tmp_path / "maps/a.yaml"


def test_a_benchmark_row_of_version_1_is_read():
    text = (Path(__file__).parent / "pairs_version_1.csv").read_text()
    pairs = [from_row(read_csv_row(row)) for row in csv.DictReader(io.StringIO(text))]
    first = pairs[0]
    assert (first.method, first.outcome, first.distorted) == ("quilt", "true accept", False)
    assert first.evidence.score == pytest.approx(0.8747, abs=1e-4)
    assert first.evidence.second_best_score == first.alternative.score == pytest.approx(0.2187, abs=1e-4)
    assert pairs[-1].negative and pairs[-1].outcome == "true reject"


def test_a_study_entry_of_version_1_is_read():
    old = {
        **{"mission": "000", "world": "house", "level": ["0"], "noise": 0.0, "method": "quilt"},
        **{"target": "robot_0", "source": "robot_1", "overlap": 0.5, "identifiable": True, "bent": True},
        **{"accepted": True, "right": False, "confidence": 0.9, "reason": None, "rotation_deg": 0.5},
        **{"scale_percent": 0.25, "displacement_m": 0.1, "displacement_cells": 2.0, "displacement_of_diagonal": 0.1},
        **{"acceptance_index": 0.9, "agreement": 0.8, "rival_agreement": 0.1, "answer": [0.0, 1.0, 0.5, 1.0]},
        **{"truth": [0.0, 0.0, 0.0, 1.0], "runner_up": None, "runner_up_agreement": None, "maps": "000/00"},
    }
    (one,) = trials_from_record({"pairs": [old], "teams": [], "failures": []}).pairs
    assert (one.outcome, one.distorted, one.pair.level) == ("false accept", True, ("0",))
    assert (one.evidence.score, one.evidence.second_best_score, one.evidence.acceptance_index) == (0.8, 0.1, 0.9)
    assert math.isnan(one.evidence.overlap)
    assert one.pair.target_file == Path("maps/000/00/robot_0.yaml")
    assert to_row(one)["tolerance_cells"] is None


def test_columns_are_unique():
    assert len(set(COLUMNS)) == len(COLUMNS)
