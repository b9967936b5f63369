"""Score of a run: its record, its table, and the scale of the target's true metres."""

import json

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.ground_truth.ambiguity_search import Identifiability
from mapping.ground_truth.truth import MapTruth, PairOverlap, PairTruth
from mapping.map_set import MapSet
from mapquilt.cli.tables import print_table
from mapquilt.cli.verbs.score import score_table
from mapquilt.evaluation.evaluated_pair import OUTCOMES, EvaluatedPair, GroundTruth, PairInfo
from mapquilt.evaluation.formatting import outcome_text
from mapquilt.runs.truth_file import RobotOrigin, RunTruth
from mapquilt.scoring.run_score import RunScore, evaluate_run_pair
from mapquilt.scoring.score_file import score_bytes
from merge.records.result import PairResult
from merge.records.verdict import Reason, Refusal

KNOWN = np.pad(np.full((30, 40), -1.0, np.float32), 10)
GRID = OccupancyGrid(GridFrame(0.1, SE2(), KNOWN.shape), KNOWN)
MAPS = MapSet(("a", "b"), (GRID, GRID), ("m", "m"))
ONE_PLACE, TWO_PLACES = Identifiability(0.8, 0.1), Identifiability(0.8, 0.79)
A_SCALE, B_SCALE = 2.0, 0.25


def scored(accepted, answer, places=ONE_PLACE):
    """Score one pair whose truth is the identity."""
    robots = tuple(
        RobotOrigin(name, SE2(), Similarity2(), MapTruth(Similarity2(scale=scale), Similarity2(scale=scale), 0.0))
        for name, scale in (("a", A_SCALE), ("b", B_SCALE))
    )
    truth = RunTruth(robots, {("a", "b"): PairTruth(Similarity2(), True, 100, 0.0, PairOverlap(0.5, places))})
    refusal = None if accepted else Refusal(Reason.LITTLE_OVERLAP)
    result = PairResult("a", "b", accepted, 0.9, refusal, answer, None, "m", None)
    return RunScore((evaluate_run_pair(MAPS, truth, result, PairInfo("a and b", "a", "b"), "quilt"),))


@pytest.mark.parametrize(
    ("accepted", "x", "places", "outcome"),
    [
        (True, 0.01, ONE_PLACE, "true accept"),
        (True, 1.0, ONE_PLACE, "false accept"),
        (False, 0.01, ONE_PLACE, "false reject"),
        (False, 0.01, TWO_PLACES, "true reject"),
    ],
)
def test_record_and_table_name_the_outcome(accepted, x, places, outcome, tmp_path, capsys):
    score = scored(accepted, Similarity2(x), places)
    record = json.loads(score_bytes(tmp_path / "score.json", score))
    assert record["pairs"][0]["outcome"] == outcome
    assert record["summary"] == score.summary()
    assert {kind: record["summary"][f"{kind.replace(' ', '_')}s"] for kind in OUTCOMES} == {
        kind: int(kind == outcome) for kind in OUTCOMES
    }
    print_table(score_table(score))
    lines = capsys.readouterr().out.splitlines()
    assert outcome in next(line for line in lines if "a <- b" in line)
    assert max(map(len, lines)) <= 80


def test_displacement_is_in_true_metres_of_the_target():
    (pair,) = scored(True, Similarity2(0.03, 0.04)).pairs
    assert pair.error.displacement_m == pytest.approx(0.05 * A_SCALE)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"accepted": True, "right": False}, "false accept"),
        ({"accepted": True, "right": False, "distorted": True}, "false accept, distorted"),
        ({"accepted": True, "right": False, "identifiable": False}, "false accept, ambiguous"),
        ({"accepted": False, "distorted": True}, "false reject, distorted"),
        ({"accepted": True, "right": True, "distorted": True}, "true accept"),
        ({"accepted": False, "identifiable": False}, "true reject"),
        ({"accepted": True, "negative": True}, "false accept, no common ground"),
        ({"accepted": None}, "-"),
    ],
)
def test_a_wrong_verdict_says_what_excuses_it(changes: dict[str, bool], text: str) -> None:
    known = {name: changes[name] for name in ("accepted", "right", "distorted") if name in changes}
    transform = None if changes.get("negative") else Similarity2()
    truth = GroundTruth(transform, identifiable=changes.get("identifiable", True))
    assert outcome_text(EvaluatedPair(PairInfo("a and b", "a", "b"), truth, "quilt", **known)) == text
