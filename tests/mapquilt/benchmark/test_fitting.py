"""Fit of the acceptance constants: known constants are recovered, from the right answers only."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mapquilt.benchmark.fitting import decide_again, fit_acceptance
from mapquilt.benchmark.held_out import hold_out_each
from mapquilt.cli.app import run
from mapquilt.cli.verbs import calibrate as verb
from mapquilt.cli.verbs.calibrate import acceptance_record
from mapquilt.evaluation.calibration import calibration
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth
from mapquilt.evaluation.transform_error import TransformError
from mapquilt.json_file import read_record, write_record
from merge.records.evidence import Evidence
from merge.verification.acceptance import decide
from merge.verification.settings import AcceptanceSettings
from tests.mapquilt.evaluation.examples import BAD, GOOD, evaluated

TRUE = AcceptanceSettings(margin_weight=24.0, contradiction_weight=90.0, conflict_weight=20.0, threshold=2.0)
EVIDENCE = Evidence(0.9, 0.95, 0.03, 0.01, 2e4, 0.5, 4.0, 900.0, 0.4, 0.7, 0.3, 1.0, None, None, 3)


def drawn(number: int, seed: int = 0, true: AcceptanceSettings = TRUE, **fields: float) -> list[EvaluatedPair]:
    """Answers that are right as often as the true constants say."""
    rng = np.random.default_rng(seed)
    trials = []
    for _ in range(number):
        score = rng.uniform(0.1, 1.0)
        measured = {
            "second_best_score": score * rng.uniform(0.3, 1.1),
            "local_violation": rng.uniform(0.0, 0.04),
            "conflict_ratio": rng.uniform(0.0, 0.1),
        }
        found = dataclasses.replace(EVIDENCE, score=score, **measured | fields)
        right = rng.random() < decide(found, true).confidence
        trials.append(evaluated(True, GOOD if right else BAD, overlap=0.6, evidence=found))
    return trials


def test_the_constants_that_made_the_answers_are_found_again():
    fitted = fit_acceptance(drawn(8000))
    assert fitted.margin_weight == pytest.approx(TRUE.margin_weight, abs=1.5)
    assert fitted.contradiction_weight == pytest.approx(TRUE.contradiction_weight, rel=0.2)
    assert fitted.conflict_weight == pytest.approx(TRUE.conflict_weight, rel=0.2)
    assert fitted.threshold == pytest.approx(TRUE.threshold, abs=0.6)
    assert fitted.min_overlap == AcceptanceSettings().min_overlap


def test_answers_that_other_rules_refuse_are_left_out():
    trials = drawn(300)
    assert fit_acceptance(trials + drawn(300, seed=2, overlap=0.01)) == fit_acceptance(trials)


def test_pairs_that_other_rules_refuse_count_among_those_to_be_refused():
    """If most negatives are refused by other rules, the remaining ones are rare, and answers more likely right."""

    def negative(overlap: float, margin: float) -> EvaluatedPair:
        evidence = dataclasses.replace(EVIDENCE, second_best_score=EVIDENCE.score - margin, overlap=overlap)
        return evaluated(False, None, negative=True, evidence=evidence)

    hard = [negative(0.5, margin) for margin in np.linspace(0.07, 0.2, 50)]
    easy = [negative(0.01, 0.1)] * 450
    alone, among = fit_acceptance(drawn(400) + hard), fit_acceptance(drawn(400) + hard + easy)
    likelier = [decide(EVIDENCE, settings).confidence for settings in (alone, among)]
    assert likelier[0] < likelier[1]
    assert among.threshold < alone.threshold - 1.0


def test_the_right_place_counts_however_imprecise():
    inexact = TransformError(4.0, 5.0, 0.6, 12.0, 0.03)
    loose = [dataclasses.replace(t, error=inexact, right=False, distorted=True) if t.right else t for t in drawn(300)]
    assert fit_acceptance(loose) == fit_acceptance(drawn(300))


def test_ambiguous_pairs_are_left_out():
    twofold = [
        dataclasses.replace(t, truth=dataclasses.replace(t.truth, identifiable=False)) for t in drawn(300, seed=1)
    ]
    assert fit_acceptance(drawn(300) + twofold) == fit_acceptance(drawn(300))


def test_each_kind_of_pair_weighs_the_same_however_many_there_are():
    """Doubling the negatives, which weigh a third together, changes nothing."""
    negatives = [dataclasses.replace(t, truth=GroundTruth(None)) for t in drawn(200, seed=1)]
    positives = drawn(200)
    once, twice = fit_acceptance(positives + negatives), fit_acceptance(positives + negatives + negatives)
    assert dataclasses.astuple(once) == pytest.approx(dataclasses.astuple(twice), rel=1e-2)


def test_answers_that_are_all_right_are_refused():
    with pytest.raises(ValueError, match="needs right and wrong ones"):
        fit_acceptance([evaluated(True, GOOD, evidence=EVIDENCE)])


def test_a_new_decision_changes_nothing_else():
    strict = dataclasses.replace(TRUE, min_confidence=0.999)
    before = drawn(5)
    for old, new in zip(before, decide_again(before, strict), strict=True):
        assert new.pair == old.pair and new.error == old.error
        assert new.confidence == decide(old.evidence, strict).confidence
        assert new.accepted == (new.confidence >= 0.999)


def test_the_record_fits_its_schema_and_holds_the_constants(tmp_path):
    trials = drawn(200)
    fitted = fit_acceptance(trials)
    write_record(tmp_path / "c.json", "calibration", acceptance_record(fitted, calibration(trials), []))
    read = read_record(tmp_path / "c.json", "calibration")
    assert AcceptanceSettings(**read["acceptance"]) == fitted
    assert read["check"]["pairs"] == 200


def test_the_schema_allows_every_constant_that_the_settings_allow(tmp_path):
    trials = drawn(200)
    record = acceptance_record(TRUE, calibration(trials), [])
    for threshold in (AcceptanceSettings().threshold, -3.0):
        record["acceptance"] = dataclasses.asdict(dataclasses.replace(AcceptanceSettings(), threshold=threshold))
        write_record(tmp_path / "c.json", "calibration", record)
    record["acceptance"]["margin_weight"] = -1.0
    with pytest.raises(ValueError, match="margin_weight"):
        write_record(tmp_path / "c.json", "calibration", record)


def test_calibrate_runs_to_its_end(tmp_path, monkeypatch, capsys):
    """On drawn answers, from whose fit the threshold comes out negative, as the shipped one is."""
    trials = drawn(400, true=dataclasses.replace(TRUE, threshold=-1.5))

    def answers(*arguments):
        arguments[-1].mkdir(parents=True)
        return [] if arguments[-1].name == "hold out" else trials

    monkeypatch.setattr(verb, "dataset_pairs", lambda *arguments: [])
    monkeypatch.setattr(verb, "_answers", answers)
    assert run(["calibrate", "--dataset", str(tmp_path), "--out", str(tmp_path / "out"), "--check", "all"]) == 0
    record = read_record(tmp_path / "out/calibration.json", "calibration")
    assert record["acceptance"]["threshold"] < 0.0
    assert record["check"]["pairs"] == 400
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        ".mapquilt-files.json",
        "calibration.json",
        "reliability.png",
    }
    assert [one["name"] for one in record["held_out"]] == ["made"]
    assert "400 pairs of the check" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--split", "train", "--check", "train"), "--check train"),
        (("--check-dataset", "{tmp}"), "--check-dataset {tmp}"),
        (("--pairs", "{tmp}/pairs.json", "--check", "test"), "--check test: with --pairs"),
    ],
)
def test_checking_on_the_fitted_split_is_refused(tmp_path, capsys, options, named):
    arguments = ["calibrate", "--dataset", str(tmp_path), "--out", str(tmp_path / "out")]
    assert run([*arguments, *(word.format(tmp=tmp_path) for word in options)]) == 2
    assert named.format(tmp=tmp_path) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_each_world_is_decided_by_a_fit_on_the_others():
    """The oracle fits once without the cave, by hand."""
    pairs = [*shown(drawn(300), "office"), *shown(drawn(300, seed=1), "cave"), *shown(drawn(300, seed=2), "maze")]
    rows = {row.name: row for row in hold_out_each(pairs, pairs)}
    others = [one for one in pairs if one.pair.world != "cave"]
    expected = calibration(decide_again(pairs[300:600], fit_acceptance(others)))
    assert set(rows) == {"office", "cave", "maze"}
    assert (rows["cave"].pairs, rows["cave"].ece, rows["cave"].auc) == (300, expected.ece, expected.auc)


def test_the_worst_comes_first():
    """In the maze the answers are right whatever the evidence says."""
    lucky = [dataclasses.replace(one, error=GOOD, right=True) for one in drawn(200, seed=3, local_violation=0.04)]
    pairs = [*shown(drawn(300), "office"), *shown(drawn(300, seed=1), "cave"), *shown(lucky, "maze")]
    rows = hold_out_each(pairs, pairs)
    assert rows[0].name == "maze"
    assert [row.ece for row in rows] == sorted((row.ece for row in rows), reverse=True)


def test_a_pair_of_two_worlds_is_in_no_fit_without_either():
    mixed = shown(drawn(50, seed=1), "cave+office")
    pairs = [*shown(drawn(300), "office"), *shown(drawn(300, seed=2), "maze"), *mixed]
    rows = {row.name: row for row in hold_out_each(pairs, pairs)}
    assert (rows["office"].pairs, rows["cave"].pairs, rows["maze"].pairs) == (350, 50, 300)


def test_the_only_world_cannot_be_held_out():
    (row,) = hold_out_each(drawn(300), drawn(300))
    assert (row.pairs, row.ece, row.auc, row.accepted) == (300, None, None, None)


def test_a_distorted_pair_counts_as_right_at_the_right_place():
    inexact = TransformError(4.0, 5.0, 0.6, 12.0, 0.03)
    pairs = [*shown(drawn(300), "office"), *shown(drawn(300, seed=1), "cave")]
    loose = [dataclasses.replace(t, error=inexact, right=False, distorted=True) if t.right else t for t in pairs]
    assert hold_out_each(loose, loose) == hold_out_each(pairs, pairs)


def shown(pairs: list[EvaluatedPair], world: str) -> list[EvaluatedPair]:
    return [dataclasses.replace(one, pair=dataclasses.replace(one.pair, world=world)) for one in pairs]
