"""The fit of the decision: constants that made the answers are found again, and count what they should."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mapquilt.benchmark.calibrate import acceptance_record
from mapquilt.benchmark.fitting import fit_acceptance, judged_again
from mapquilt.benchmark.trial import Trial
from mapquilt.cli.app import run
from mapquilt.evaluation.calibration import calibration
from mapquilt.evaluation.transform_error import TransformError
from mapquilt.json_file import read_record, write_record
from merge.records.result import Evidence
from merge.verification.acceptance import AcceptanceSettings, decide
from tests.mapquilt.benchmark.made import BAD, GOOD, answer, pair, trial

TRUE = AcceptanceSettings(margin_weight=24.0, contradiction_weight=90.0, threshold=2.0)
EVIDENCE = Evidence(0.9, 0.95, 0.03, 0.01, 2e4, 0.5, 4.0, 900.0, 0.4, 0.7, 0.3, 1.0, None, None, 3)


def drawn(number: int, seed: int = 0, **fields: float) -> list[Trial]:
    """Answers that are right as often as the true constants say."""
    rng = np.random.default_rng(seed)
    trials = []
    for _ in range(number):
        score = rng.uniform(0.1, 1.0)
        measured = {
            "second_best_score": score * rng.uniform(0.3, 1.1),
            "deep_free_space_violation": rng.uniform(0.0, 0.04),
        }
        found = dataclasses.replace(EVIDENCE, score=score, **measured | fields)
        right = rng.random() < decide(found, TRUE).confidence
        trials.append(trial(pair(overlap=0.6), answer(True, GOOD if right else BAD, evidence=found)))
    return trials


def test_the_constants_that_made_the_answers_are_found_again():
    fitted = fit_acceptance(drawn(8000))
    assert fitted.margin_weight == pytest.approx(TRUE.margin_weight, abs=1.5)
    assert fitted.contradiction_weight == pytest.approx(TRUE.contradiction_weight, rel=0.2)
    assert fitted.threshold == pytest.approx(TRUE.threshold, abs=0.6)
    assert fitted.min_overlap == AcceptanceSettings().min_overlap


def test_what_other_rules_refuse_is_left_out():
    trials = drawn(300)
    assert fit_acceptance(trials + drawn(300, seed=2, overlap=0.01)) == fit_acceptance(trials)


def test_pairs_that_other_rules_refuse_count_among_those_to_be_refused():
    """Where they are most of these, what is left of them is rare, and an answer the likelier right."""

    def negative(overlap: float, lead: float) -> Trial:
        evidence = dataclasses.replace(EVIDENCE, second_best_score=EVIDENCE.score - lead, overlap=overlap)
        return trial(pair(negative=True), answer(False, None, evidence=evidence))

    hard = [negative(0.5, lead) for lead in np.linspace(0.07, 0.2, 50)]
    easy = [negative(0.01, 0.1)] * 450
    alone, among = fit_acceptance(drawn(400) + hard), fit_acceptance(drawn(400) + hard + easy)
    likelier = [decide(EVIDENCE, settings).confidence for settings in (alone, among)]
    assert likelier[0] < likelier[1]
    assert among.threshold < alone.threshold - 1.0


def test_a_right_place_told_inexactly_teaches_that_it_is_right():
    inexact = TransformError(4.0, 5.0, 0.6, 12.0, 0.03)
    loose = [
        dataclasses.replace(t, answers=(dataclasses.replace(t.answers[0], error=inexact),), bent=True)
        if t.answers[0].right
        else t
        for t in drawn(300)
    ]
    assert fit_acceptance(loose) == fit_acceptance(drawn(300))


def test_a_pair_that_two_places_fit_teaches_nothing():
    twofold = [dataclasses.replace(t, pair=pair(overlap=0.6, identifiable=False)) for t in drawn(300, seed=1)]
    assert fit_acceptance(drawn(300) + twofold) == fit_acceptance(drawn(300))


def test_each_kind_of_pair_weighs_the_same_however_many_there_are():
    """Doubling the negatives, which weigh a third together, changes nothing."""
    negatives = [dataclasses.replace(t, pair=pair(negative=True)) for t in drawn(200, seed=1)]
    positives = drawn(200)
    once, twice = fit_acceptance(positives + negatives), fit_acceptance(positives + negatives + negatives)
    assert dataclasses.astuple(once) == pytest.approx(dataclasses.astuple(twice), rel=1e-2)


def test_answers_that_are_all_right_fit_nothing():
    with pytest.raises(ValueError, match="needs right and wrong answers"):
        fit_acceptance([trial(pair(), answer(True, GOOD, evidence=EVIDENCE))])


def test_judging_again_moves_the_verdict_and_nothing_else():
    strict = dataclasses.replace(TRUE, min_confidence=0.999)
    before = drawn(5)
    for old, new in zip(before, judged_again(before, strict), strict=True):
        assert new.pair == old.pair and new.answers[0].error == old.answers[0].error
        assert new.answers[0].confidence == decide(old.answers[0].evidence, strict).confidence
        assert new.answers[0].accepted == (new.answers[0].confidence >= 0.999)


def test_the_record_fits_its_schema_and_bears_the_constants(tmp_path):
    trials = drawn(200)
    fitted = fit_acceptance(trials)
    write_record(tmp_path / "c.json", "calibration", acceptance_record(fitted, calibration(trials, 0)))
    read = read_record(tmp_path / "c.json", "calibration")
    assert AcceptanceSettings(**read["acceptance"]) == fitted
    assert read["check"]["pairs"] == 200


@pytest.mark.parametrize(
    ("told", "named"),
    [
        (("--split", "train", "--check", "train"), "--check train"),
        (("--check-dataset", "{tmp}"), "--check-dataset {tmp}"),
    ],
)
def test_checking_on_what_was_fitted_is_refused(tmp_path, capsys, told, named):
    arguments = ["calibrate", "--dataset", str(tmp_path), "--out", str(tmp_path / "out")]
    assert run([*arguments, *(word.format(tmp=tmp_path) for word in told)]) == 2
    assert named.format(tmp=tmp_path) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
