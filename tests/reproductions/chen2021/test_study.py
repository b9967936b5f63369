"""The reproduction on short missions: answers, files, and interruptions."""

from __future__ import annotations

import csv
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapquilt.cli.entry import run_app
from mapquilt.jobs.runner import Runner
from mapquilt.json_file import to_text
from reproductions.chen2021 import missions
from reproductions.chen2021.__main__ import app
from reproductions.chen2021.answers import answers_of, compared_cells
from reproductions.chen2021.cases import BASE, CASES, FLOOR_MAPS, HALL_MAPS
from reproductions.chen2021.make import SPEC_FILE, StudySpec, make_study
from reproductions.chen2021.map_store import maps_bytes, read_maps
from reproductions.chen2021.methods import method_named
from tests.conftest import hashes

METHODS = ("sift as published", "morphology as published")
ONLY = [word for title in METHODS for word in ("--method", title)]
FILES = ("table.csv", "answers.csv")


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
    patch = pytest.MonkeyPatch()
    patch.setattr(missions, "HALL_DURATION", 15.0)
    patch.setattr(missions, "FLOOR_DURATION", 10.0)
    yield
    patch.undo()


@pytest.fixture(scope="module")
def study(short, tmp_path_factory):
    """One seed, both pipelines; not to be written to."""
    out = tmp_path_factory.mktemp("thesis") / "study"
    assert thesis("--out", out, "--seeds", 1, "--workers", 1, *ONLY) == 0
    return out


@pytest.fixture(scope="module")
def hall(study):
    return read_maps(study / "maps/hall-000.npz")


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_each_case_and_method_has_its_row_with_the_thesis_beside(study):
    table = rows(study / "table.csv")
    assert [(row["case"], row["method"]) for row in table] == [(case.name, m) for case in CASES for m in METHODS]
    first = table[0]
    beside = [first[name] for name in ("runs", "thesis_right", "thesis_runs", "thesis_index")]
    assert beside == ["1", "0", "20", "0.951"]
    assert 0.0 <= float(first["right_low"]) <= int(first["right"]) <= float(first["right_high"]) <= 1.0
    text = (study / "table.md").read_text(encoding="utf-8")
    assert "| set 1 | another start |" in text


def test_every_picture_is_there(study):
    names = {path.stem for path in (study / "pictures").glob("*.png")}
    assert {"maps-hall", "maps-floor", "right", "index", "set-1", "office-1-and-2"} <= names
    assert len(names) == 2 + 2 + sum(not case.team for case in CASES)


def test_answers_are_scored_against_the_true_starts(study, hall):
    """An independent oracle: the error at the common cells, from the poses of both starts."""
    for row in rows(study / "answers.csv"):
        if row["case"] != "set 1":
            continue
        answer = Similarity2(*(float(row[name]) for name in ("x", "y", "yaw", "scale")))
        target, source = hall[BASE], hall["set 1"]
        points = source.grid.frame.metres_from_cells(np.argwhere(source.grid.known))
        there = target.world_from_map.inverse().apply(source.world_from_map.apply(points))
        cells = target.grid.frame.cells_from_metres(there)
        common = target.grid.frame.contains(cells)
        common[common] = target.grid.known[cells[common, 0], cells[common, 1]]
        off = np.hypot(*(answer.apply(points[common]) - there[common]).T).mean() / target.grid.frame.resolution
        assert float(row["displacement_cells"]) == pytest.approx(off, rel=1e-6)
        assert (row["right"] == "True") == (float(row["displacement_cells"]) <= 10.0)


def test_set_1_differs_by_245_degrees_and_the_others_by_188(hall):
    for name, degrees in (("set 1", 245.4), ("set 2", 188.1), ("set 3", 188.1)):
        turn = hall[name].world_from_map.inverse() @ hall[BASE].world_from_map
        assert math.degrees(turn.yaw) % 360.0 == pytest.approx(degrees, abs=0.1)


def test_maps_of_one_mission_share_its_start_and_differ_as_the_case_says(hall):
    assert list(hall) == list(HALL_MAPS)
    others = [hall[name] for name in HALL_MAPS if name not in (BASE, "set 1")]
    assert all(each.world_from_map == others[0].world_from_map for each in others)
    assert hall["0.2 m cells"].grid.frame.resolution == 0.2
    walls = {name: np.count_nonzero(hall[name].grid.occupied) for name in ("noise 0.05 m", "set 3")}
    assert walls["set 3"] > walls["noise 0.05 m"]


def test_maps_agree_at_the_truth_and_not_a_metre_away(hall):
    target, source = hall[BASE], hall["0.025 m cells"]
    truth = Similarity2.from_se2(target.world_from_map.inverse() @ source.world_from_map)
    assert compared_cells(target, source).acceptance_index > 0.97
    off = Similarity2.from_se2(SE2(1.0, 1.0)) @ truth
    assert compared_cells(target, source, off).acceptance_index < compared_cells(target, source).acceptance_index


def test_the_floors_team_is_right_only_where_its_pairs_are(study):
    maps = read_maps(study / "maps/floor-000.npz")
    found = {answer.case: answer for answer, _ in answers_of("floor", maps, method_named("morphology as published"), 0)}
    assert set(found) == {case.name for case in CASES if case.place == "floor"}
    if found["office, all three"].pair.right:
        assert sum(found[name].pair.right for name in ("office 1 and 3", "office 2 and 3", "office 1 and 2")) >= 2
    assert set(maps) == set(FLOOR_MAPS)


def test_maps_survive_a_round_trip(hall, tmp_path):
    (tmp_path / "maps.npz").write_bytes(maps_bytes(hall))
    again = read_maps(tmp_path / "maps.npz")
    for name, each in hall.items():
        assert np.array_equal(again[name].grid.log_odds, each.grid.log_odds)
        assert again[name].grid.frame == each.grid.frame
        assert again[name].world_from_map == each.world_from_map


def test_an_interrupted_study_continues_and_ends_the_same(study, tmp_path, short):
    out = tmp_path / "study"

    def interrupt(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_study(StudySpec(1, METHODS), out, Runner(), interrupt)
    with (out / ".journal.jsonl").open("ab") as journal:
        journal.write(b'{"task": "hall 0 sift as pub')  # what a kill may leave
    assert thesis("--out", out, "--seeds", 1, "--workers", 1, *ONLY) == 0
    kept = ("timings.csv", "table.md", ".journal.jsonl")
    assert hashes(out, but=kept) == hashes(study, but=kept)


def test_maps_that_were_damaged_are_made_again(study, tmp_path, short):

    out = Path(shutil.copytree(study, tmp_path / "study"))
    (out / "maps/hall-000.npz").write_bytes(b"cut off")
    asked = []
    make_study(StudySpec(1, METHODS), out, Runner(), lambda done, total: asked.append(done))
    assert asked[0] == 5  # all but the hall's maps
    assert hashes(out / "maps") == hashes(study / "maps")


def test_a_finished_study_accepts_more_methods_without_running_the_old_ones(study, tmp_path):

    out = Path(shutil.copytree(study, tmp_path / "study"))
    reported = []
    more = StudySpec(1, (*METHODS, "sift_orb as published"))
    make_study(more, out, Runner(), lambda done, total: reported.append((done, total)))
    assert reported[0] == (6, 8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seeds", "0"), "--seeds 0: must lie between 1 and 1000"),
        (("--method", "surf"), "--method surf: must be one of sift as published,"),
        (("--method", "sift", "--method", "sift"), "--method sift: is named twice"),
    ],
)
def test_a_bad_option_is_refused_before_anything_is_written(arguments, message, tmp_path, capfd):
    assert refused(capfd, "--out", str(tmp_path / "study"), *arguments).startswith(f"chen2021: {message}")
    assert not (tmp_path / "study").exists()


def test_a_foreign_folder_is_refused(tmp_path, capfd):
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters/dear.txt").write_text("hello", encoding="utf-8")
    assert "refusing to write into it" in refused(capfd, "--out", str(tmp_path / "letters"), "--seeds", "1")
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / SPEC_FILE).write_text(to_text({"schema": "mapquilt-thesis/0"}), encoding="utf-8")
    assert "holds a study of Chen (2021) with other settings" in refused(capfd, "--out", str(tmp_path / "old"))
    assert [path.name for path in (tmp_path / "letters").iterdir()] == ["dear.txt"]
