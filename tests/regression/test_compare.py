"""Classification of regressions, and validity of the golden files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from mapquilt.cli.entry import run_app
from tests.regression.__main__ import app
from tests.regression.compare import FACTOR, FAILING, FLOORS, compare
from tests.regression.golden import GoldenPair, read_golden, write_golden
from worlds.families.registry import FAMILIES

GOLDEN = Path(__file__).parents[1] / "golden"
RIGHT = GoldenPair("p", "aaaa", 0.5, "true accept", 0.95, 0.5, 0.2, 1.5, None)
MISSED = replace(RIGHT, outcome="false reject", confidence=0.3, reason="too little overlap")
REFUSED = replace(MISSED, outcome="true reject")
WRONG = replace(RIGHT, outcome="false accept", displacement_cells=80.0)


def kinds(before: GoldenPair, now: GoldenPair) -> list[str]:
    return [change.kind for change in compare("house", {before.name: before}, {now.name: now})]


@pytest.mark.parametrize("verdict", [RIGHT, MISSED, REFUSED, WRONG])
def test_an_unchanged_pair_is_no_change(verdict):
    assert kinds(verdict, verdict) == []


@pytest.mark.parametrize(
    ("before", "now", "kind"),
    [
        (RIGHT, MISSED, "worse"),
        (RIGHT, WRONG, "worse"),
        (MISSED, WRONG, "worse"),
        (REFUSED, WRONG, "worse"),
        (MISSED, RIGHT, "better"),
        (WRONG, MISSED, "better"),
        (WRONG, RIGHT, "better"),
        (RIGHT, replace(RIGHT, confidence=0.9), "other"),
        (MISSED, replace(MISSED, reason="two answers equally good"), "other"),
        (RIGHT, replace(RIGHT, sample="bbbb"), "sample changed"),
        (RIGHT, replace(WRONG, sample="bbbb"), "sample changed"),
    ],
)
def test_each_change_is_classified(before, now, kind):
    assert kinds(before, now) == [kind]
    assert ("worse" in FAILING, "sample changed" in FAILING, "better" in FAILING) == (True, True, False)


@pytest.mark.parametrize("name", FLOORS)
def test_errors_may_grow_by_the_factor_and_the_floor_and_no_more(name):
    allowed = FACTOR * getattr(RIGHT, name) + FLOORS[name]
    assert kinds(RIGHT, replace(RIGHT, **{name: allowed - 0.001})) == ["other"]
    (change,) = compare("house", {"p": RIGHT}, {"p": replace(RIGHT, **{name: allowed + 0.001})})
    assert change.kind == "worse"
    assert name in change.words and "still true accept" in change.words


def test_errors_of_refused_answers_may_change():
    assert kinds(MISSED, replace(MISSED, displacement_cells=500.0)) == ["other"]


def test_new_and_missing_pairs_are_changes():
    gone, new = compare("house", {"p": RIGHT}, {"q": replace(RIGHT, name="q")})
    assert (gone.kind, gone.pair, new.kind, new.pair) == ("set changed", "p", "set changed", "q")


def test_golden_files_are_read_as_they_were_written(tmp_path):
    verdicts = {"house": {"p": RIGHT, "q": replace(MISSED, name="q", rotation_deg=None)}, "maze": {}}
    write_golden(tmp_path, verdicts)
    assert read_golden(tmp_path) == verdicts
    assert len((tmp_path / "house.json").read_text().splitlines()) == 4
    write_golden(tmp_path, {"house": verdicts["house"]})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["house.json"]


def test_the_golden_files_cover_every_family():
    golden = read_golden(GOLDEN)
    assert set(golden) == set(FAMILIES)
    every = [verdict for found in golden.values() for verdict in found.values()]
    assert len(every) == len(FAMILIES) * 10
    assert sum(verdict.outcome == "true accept" for verdict in every) >= len(every) / 3
    assert len({verdict.sample for verdict in every}) == len(every)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--family", "atlantis"), "--family atlantis: unknown"),
        (("--update", "--family", "house"), "--update: rewrites all families"),
        ((), "holds no golden file; make regression-update writes them"),
    ],
)
def test_invalid_golden_files_are_refused_in_one_line(arguments, words, tmp_path, capsys):
    assert run_app(app, ["--golden", str(tmp_path), *arguments], "regression") == 2
    line = capsys.readouterr().err
    assert words in line and line.count("\n") == 1


def test_a_damaged_golden_file_is_named(tmp_path):
    (tmp_path / "house.json").write_text('{"schema": "mapquilt-golden/2", "pairs": [{"name": "p"}]}')
    with pytest.raises(ValueError, match=r"house.json: is no golden file"):
        read_golden(tmp_path)
