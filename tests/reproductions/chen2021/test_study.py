"""The reproduction on short missions: answers, files, and interruptions."""

from __future__ import annotations

import csv
import shutil

import pytest

from mapquilt.cli.entry import run_app
from mapquilt.jobs.journal import JOURNAL_FILE
from mapquilt.jobs.runner import Runner
from mapquilt.json_file import to_text
from reproductions.chen2021 import missions
from reproductions.chen2021.__main__ import app
from reproductions.chen2021.answers import Answer
from reproductions.chen2021.cases import CASES, trials
from reproductions.chen2021.files import PICTURES, SHOWN, telling_seed
from reproductions.chen2021.make import SPEC_FILE, Study, make_study
from reproductions.chen2021.methods import CORRECTED, METHODS, PLAIN
from tests.conftest import hashes


def thesis(*arguments: object) -> int:
    """Run the study's command in this process: its exit status."""
    return run_app(app, [str(argument) for argument in arguments], "chen2021")


def refused(capfd, *arguments: object) -> str:
    """The one line with which a call is refused."""
    assert thesis(*arguments) == 2
    (line,) = capfd.readouterr().err.splitlines()
    return line


@pytest.fixture(scope="module")
def short():
    """Missions of some seconds: real ones, but small."""
    with pytest.MonkeyPatch.context() as patch:
        for name, seconds in (("HALL", 16.0), ("PATROL", 10.0), ("FLOOR", 10.0)):
            patch.setattr(missions, f"{name}_DURATION", seconds)
        yield


@pytest.fixture(scope="module")
def study(short, tmp_path_factory):
    """One seed; not to be written to."""
    out = tmp_path_factory.mktemp("thesis") / "study"
    assert thesis("--out", out, "--seeds", 1, "--workers", 1) == 0
    return out


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_each_trial_and_method_has_its_row(study):
    table = rows(study / "table.csv")
    names = [(row["trial"], row["method"]) for row in table]
    assert len(set(names)) == len(names)
    assert {trial.name for trial in trials()} | {case.name for case in CASES} <= {trial for trial, _ in names}
    assert {method for _, method in names} == set(METHODS)
    for row in table:
        low, share, high = float(row["right_low"]), int(row["right"]) / int(row["runs"]), float(row["right_high"])
        assert 0.0 <= low <= share <= high <= 1.0
        assert (int(row["maps"]), int(row["runs"])) == (
            1,
            METHODS[row["method"]].runs if "three" not in row["trial"] else 1,
        )


@pytest.mark.slow
def test_the_thesis_stands_beside_and_every_picture_is_there(study):
    text = (study / "table.md").read_text(encoding="utf-8")
    assert "| set 1 | rotation of 245 degrees | 0 of 20 |" in text
    names = {path.stem for path in (study / "pictures").glob("*.png")}
    assert names == {"cases", "ablation", "steps", "matches"}
    assert len(names) == PICTURES


@pytest.mark.slow
def test_an_interrupted_study_continues_and_ends_the_same(study, tmp_path, short):
    out = tmp_path / "study"
    out.mkdir()
    shutil.copy(study / SPEC_FILE, out)
    finished, _ = (study / JOURNAL_FILE).read_bytes().splitlines(keepends=True)
    (out / JOURNAL_FILE).write_bytes(finished + b'{"task": "floor 0", "answ')  # what a kill may leave
    asked = []
    make_study(1, out, Runner(), lambda done, total: asked.append((done, total)))
    assert asked == [(1, 2), (2, 2)]
    assert thesis("--out", out, "--seeds", 1, "--workers", 1) == 0
    assert hashes(out) == hashes(study)


def test_too_few_seeds_are_refused_before_anything_is_written(tmp_path, capfd):
    message = refused(capfd, "--out", str(tmp_path / "study"), "--seeds", "0")
    assert message == "chen2021: --seeds 0: must lie between 1 and 1000"
    assert not (tmp_path / "study").exists()


def test_a_foreign_folder_is_refused(tmp_path, capfd):
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters/dear.txt").write_text("hello", encoding="utf-8")
    assert "refusing to write into it" in refused(capfd, "--out", str(tmp_path / "letters"), "--seeds", "1")
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / SPEC_FILE).write_text(to_text({"schema": "mapquilt-thesis/0"}), encoding="utf-8")
    assert "holds a study of Chen (2021) with other settings" in refused(capfd, "--out", str(tmp_path / "old"))
    assert [path.name for path in (tmp_path / "letters").iterdir()] == ["dear.txt"]


@pytest.mark.parametrize(
    ("plain", "corrected", "seed"),
    [((False, False), (False, True), 1), ((True, False), (True, True), 1), ((True, True), (True, True), 0)],
)
def test_the_pictures_show_the_first_pair_on_which_only_the_correction_is_right(plain, corrected, seed):
    answers = [
        Answer(SHOWN.name, method, number, 0, right, accepted=True)
        for method, flags in ((PLAIN, plain), (CORRECTED, corrected))
        for number, right in enumerate(flags)
    ]
    assert telling_seed(Study(2, tuple(answers))) == seed
