"""The score of a run: what became of each pair, and in whose metres it is measured."""

import json
import math
import re

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import Identifiability
from mapping.ground_truth.truth import MapTruth, PairOverlap, PairTruth
from mapping.map_set import MapSet
from mapquilt.cli.tables import print_table, score_table
from mapquilt.evaluation.run_score import score_answer, score_bytes
from mapquilt.merging.merge_file import MergeAnswer, PairRecord
from mapquilt.runs.truth_file import RobotOrigin, RunTruth

KNOWN = np.pad(np.full((30, 40), -1.0, np.float32), 10)
GRID = OccupancyGrid(GridFrame(0.1, SE2(), KNOWN.shape), KNOWN)
MAPS = MapSet(("a", "b"), (GRID, GRID), ("m", "m"))
DIAGONAL = 0.1 * 50
ONE_PLACE, TWO_PLACES, APART = Identifiability(0.8, 0.1), Identifiability(0.8, 0.79), Identifiability(0.0, 0.0)
A_SCALE, B_SCALE = 2.0, 0.25


def scored(accepted, answer, places=ONE_PLACE, residual=None):
    """The score of one pair whose truth is the identity."""
    robots = tuple(
        RobotOrigin(name, SE2(), Similarity2(), MapTruth(Similarity2(scale=scale), Similarity2(scale=scale), 0.0))
        for name, scale in (("a", A_SCALE), ("b", B_SCALE))
    )
    pair = PairTruth(Similarity2(), residual is not None, 100, residual, PairOverlap(0.5, places))
    told = PairRecord("a", "b", accepted, 0.9, None if accepted else "too little overlap", answer, None)
    return score_answer(MAPS, RunTruth(robots, {("a", "b"): pair}), MergeAnswer("a", {"a": Similarity2()}, (told,)))


RIGHT, WRONG = Similarity2(0.01), Similarity2(1.0)


@pytest.mark.parametrize(
    ("accepted", "answer", "places", "outcome"),
    [
        (True, RIGHT, ONE_PLACE, "right"),
        (True, RIGHT, TWO_PLACES, "right"),
        (True, WRONG, ONE_PLACE, "wrong"),
        (True, WRONG, APART, "wrong"),
        (False, RIGHT, ONE_PLACE, "missed"),
        (False, WRONG, ONE_PLACE, "missed"),
        (False, None, ONE_PLACE, "missed"),
        (False, WRONG, TWO_PLACES, "rightly refused"),
        (False, RIGHT, APART, "rightly refused"),
        (False, None, APART, "rightly refused"),
    ],
)
def test_a_refusal_is_right_where_there_is_not_one_right_answer(accepted, answer, places, outcome, tmp_path, capsys):
    score = scored(accepted, answer, places)
    assert score.pairs[0].outcome == outcome
    record = json.loads(score_bytes(tmp_path / "score.json", score))
    assert record["pairs"][0]["outcome"] == outcome
    counted = {"right": "right_and_accepted", "wrong": "wrong_accepts"}.get(outcome, outcome.replace(" ", "_"))
    kinds = ("right_and_accepted", "wrong_accepts", "missed", "rightly_refused")
    assert [record["summary"][kind] for kind in kinds] == [int(kind == counted) for kind in kinds]
    print_table(score_table(score))
    (row,) = (line for line in capsys.readouterr().out.splitlines() if "a <- b" in line)
    assert outcome in re.split(r"\s{2,}", row)


def test_displacement_is_in_true_metres_of_the_target():
    (pair,) = scored(True, Similarity2(0.03, 0.04)).pairs
    assert pair.error.displacement_m == pytest.approx(0.05 * A_SCALE)
    assert pair.error.displacement_cells == pytest.approx(0.5)
    assert pair.error.displacement_of_diagonal == pytest.approx(0.05 / DIAGONAL)


def test_a_pair_is_bent_where_its_residual_exceeds_half_the_displacement_allowed():
    allowed = 0.015 * DIAGONAL * A_SCALE
    assert [scored(True, RIGHT, residual=share * allowed).pairs[0].bent for share in (0.45, 0.55)] == [False, True]
    assert scored(True, RIGHT).pairs[0].bent is None
    assert math.isclose(scored(True, RIGHT, residual=0.02).pairs[0].residual_m, 0.02)
