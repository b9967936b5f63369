"""The command line: one clear line for bad input, exit statuses, JSON, and nothing half-written."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

import mapquilt.cli.verbs.score
from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapquilt.cli import exit_status
from mapquilt.cli.app import load_verb
from mapquilt.merging.remedies import ADVICE
from merge.records.verdict import Reason
from tests.conftest import command, hashes


def office_map(seed=0):
    """A map with much structure: rooms of random sizes with doors and clutter."""
    rng = np.random.default_rng(seed)
    log_odds = np.zeros((260, 340), np.float32)
    log_odds[20:240, 20:320] = -2.0
    for col in np.cumsum(np.r_[20, rng.integers(40, 70, 5)]):
        log_odds[20:240, col : col + 3] = 3.0
        door = rng.integers(40, 200)
        log_odds[door : door + 20, col : col + 3] = -2.0
    for row in (20, 90, 150, 237):
        log_odds[row : row + 3, 20:320] = 3.0
    for row in (90, 150):
        for door in rng.integers(30, 290, 3):
            log_odds[row : row + 3, door : door + 20] = -2.0
    for _ in range(40):
        row, col = rng.integers(30, 220), rng.integers(30, 300)
        log_odds[row : row + rng.integers(3, 12), col : col + rng.integers(3, 12)] = 3.0
    return OccupancyGrid(GridFrame(0.05, SE2(-1.0, 2.0), log_odds.shape), log_odds)


@pytest.fixture
def two_maps(tmp_path):
    grid = office_map()
    save_map(grid, tmp_path / "a")
    save_map(grid, tmp_path / "b")
    return tmp_path / "a.yaml", tmp_path / "b.yaml"


def refused(capsys, *arguments):
    """The one line with which a call is refused."""
    status = command(*arguments)
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("mapquilt: ")
    assert "Traceback" not in captured.err
    return lines[0]


PAST_ALL = [
    ("--duration", "1e300", "1e+300"),
    ("--duration", "86401", "86401.0"),
    ("--robots", "1000000000", "1000000000"),
    ("--rate", "nan", "nan Hz"),
    ("--width", "1e300", "1e+300 m"),
    ("--speed", "1e300", "1e+300"),
    ("--turn-rate", "inf", "inf"),
    ("--noise", "1e300", "1e+300"),
    ("--noise", "21", "21.0"),
    ("--resolution", "0.001", "0.001"),
    ("--resolution", "nan", "nan"),
    ("--clear-range", "1e300", "1e+300"),
    ("--max-offset", "1e15", "1000000000000000.0"),
    ("--max-rotation", "nan", "nan"),
    ("--scale", "1e-300:1", "1e-300:1"),
    ("--scale", "1000:1000", "1000:1000"),
    ("--scale", "1_0:2_0", "1_0:2_0"),
    ("--scale", "nan:1", "nan:1"),
    ("--scale", "1:inf", "1:inf"),
    ("--scale", "1", "1"),
    ("--seed", str(2**128), str(2**128)),
]
"""Options past any robot, map or mission: the value as given, and as the refusal tells it."""


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("simulate", "moon"), ("moon", "office")),
        (("simulate", "office", "--robots", "0"), ("robots", "0")),
        (("simulate", "office", "--robots", "two"), ("--robots", "'two' should be a valid integer")),
        (("simulate", "office", "--robots", "1.5"), ("--robots", "'1.5' should be a valid integer")),
        (
            ("merge", "a.yaml", "b.yaml", "--unknown", "300"),
            ("--unknown 300: must be a grey level from 0 to 255, or none",),
        ),
        (("merge", "a\udcff.yaml", "b.yaml"), (r"a\udcff.yaml: is not UTF-8",)),
        (("simulate", ""), ("the name of the world is empty",)),
        (("simulate", "office", "--duration", "-5"), ("duration", "-5")),
        (("simulate", "office", "--duration", "nan"), ("duration", "nan")),
        (("simulate", "office", "--noise", "-1"), ("noise", "-1")),
        (("simulate", "office", "--seed", "-1"), ("seed", "-1")),
        (("simulate", "office", "--resolution", "0"), ("resolution", "0")),
        (("simulate", "office", "--poses", "guess"), ("poses", "guess")),
        (("simulate", "office", "--model", "magic"), ("magic", "octomap")),
        (("simulate", "office", "--robots", "30"), ("--robots 30", "between 1 and 29")),
        (("simulate", "office", "--scale", "wide"), ("scale", "wide")),
        (("simulate", "office", "--scale", "2:1"), ("--scale 2:1: must be LO:HI",)),
        (("simulate", "office", "--max-rotation", "200"), ("max-rotation", "200")),
        (("simulate", "office", "--max-offset", "inf"), ("--max-offset inf: must lie",)),
        (("sense", "no-such-run"), ("no-such-run",)),
        (("dataset", "make", "smok"), ("smok: no such file", "did you mean smoke?", "noise-sweep")),
        *((("simulate", "office", option, value), (f"{option} {shown}: must ",)) for option, value, shown in PAST_ALL),
    ],
)
def test_bad_settings_end_in_one_line_and_leave_nothing(capsys, tmp_path, monkeypatch, arguments, expected):
    monkeypatch.chdir(tmp_path)
    line = refused(capsys, *arguments, "--out", "run")
    assert all(text in line for text in expected)
    assert list(tmp_path.iterdir()) == []


def truncated_pgm(folder):
    (folder / "bad.pgm").write_bytes(b"P5\n40 30\n255\n" + bytes(100))
    return "bad.pgm"


def empty_file(folder):
    (folder / "bad.png").touch()
    return "bad.png"


def yaml_with(text):
    def write(folder):
        (folder / "bad.yaml").write_text(text)
        return "bad.yaml"

    return write


GOOD = "image: a.pgm\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


@pytest.mark.parametrize(
    ("write", "expected"),
    [
        (lambda folder: "missing.yaml", ("missing.yaml",)),
        (truncated_pgm, ("bad.pgm",)),
        (empty_file, ("bad.png",)),
        (yaml_with(GOOD), ("bad.yaml", "resolution")),
        (yaml_with(GOOD + "resolution: 0\n"), ("bad.yaml", "resolution", "0")),
        (yaml_with(GOOD + "resolution: .nan\n"), ("bad.yaml", "resolution", "nan")),
        (yaml_with(GOOD.replace("a.pgm", "../c.pgm") + "resolution: 0.05\n"), ("bad.yaml", "../c.pgm")),
        (yaml_with(GOOD.replace("a.pgm", "gone.pgm") + "resolution: 0.05\n"), ("gone.pgm",)),
        (yaml_with("- 1\n"), ("bad.yaml",)),
        (lambda folder: folder.name, ("folder",)),
    ],
)
def test_bad_maps_end_in_one_line(capsys, two_maps, tmp_path, monkeypatch, write, expected):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    bad = write(tmp_path) if write.__name__ != "<lambda>" else write(tmp_path / "folder")
    line = refused(capsys, "merge", "a.yaml", bad, "--out", "merged")
    assert all(text in line for text in expected), line
    assert not (tmp_path / "merged").exists()


@pytest.mark.parametrize(("grey", "says"), [(205, "unknown"), (0, "occupied"), (254, "free")])
def test_a_picture_of_one_grey_is_bad_input(capsys, two_maps, tmp_path, grey, says):
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((500, 500), grey, np.uint8))
    assert f"grey.png: every cell of the map is {says}" in refused(capsys, "merge", two_maps[0], tmp_path / "grey.png")


def test_the_table_states_the_direction_of_the_scale(capsys, two_maps, tmp_path):
    cv2.imwrite(str(tmp_path / "plain.png"), cv2.imread(str(tmp_path / "a.pgm"), cv2.IMREAD_GRAYSCALE))
    assert command("merge", *two_maps, tmp_path / "plain.png") == 0
    printed = capsys.readouterr().out.partition("\n\n# ")[0]
    rows = {line.split("  ")[0].strip(): line for line in printed.splitlines()}
    assert max(map(len, printed.splitlines())) <= 80
    assert printed.count("m/cell") == 2  # of a and plain, and of b and plain
    assert "1.0000 " in rows["a <- b"]
    assert "0.0500 " in rows["a <- plain"]


@pytest.mark.parametrize("scale", ["2:0.5", "0:1", "nan:1", "1:inf", "wide", "1", "0.001:0.001", "1e-300:1", "1_0:2_0"])
def test_bad_scale_names_the_value(capsys, two_maps, scale):
    assert f"--scale {scale}: must be " in refused(capsys, "merge", *two_maps, "--scale", scale)


@pytest.mark.parametrize("option", ["--scale=1000:1000", "--noise=1e300", "--set=lidar.range_sigma=1e7", "--parts=99"])
def test_a_setting_that_sense_refuses_is_named_by_its_option(capsys, merged_run, tmp_path, option):
    name = option.partition("=")[0]
    line = refused(capsys, "sense", merged_run, option, "--out", tmp_path / "run")
    assert line.startswith(f"mapquilt: {name} ")
    assert "must " in line
    assert list(tmp_path.iterdir()) == []


def test_a_request_for_too_much_memory_is_refused_in_one_line(capsys, monkeypatch, merged_run):
    def huge(run):
        np.empty(2**58, np.uint8)

    monkeypatch.setattr(mapquilt.cli.verbs.score, "score_run", huge)
    assert "not enough memory" in refused(capsys, "score", merged_run)


def test_worlds_show_draws_the_world_that_simulate_uses():
    verbs = load_verb("worlds").commands["show"], load_verb("simulate")
    shown, driven = ({option.name: option.default for option in verb.params} for verb in verbs)
    assert shown["seed"] == driven["seed"]


def test_unknown_method_lists_the_known_ones(capsys, two_maps):
    line = refused(capsys, "merge", *two_maps, "--method", "magic")
    assert "magic" in line
    assert "sift" in line


def test_a_method_answers_as_published_and_the_record_names_it(capsys, two_maps):
    assert command("merge", *two_maps, "--method", "orb", "--as-published", "--json") in (0, 1)
    record = json.loads(capsys.readouterr().out)
    assert record["method"] == "orb as published"
    assert record["pairs"][0]["evidence"] is None


def test_a_method_without_an_own_answer_is_named(capsys, two_maps):
    assert "'quilt'" in refused(capsys, "merge", *two_maps, "--method", "quilt", "--as-published")


def test_a_missing_run_is_named_as_missing(capsys, tmp_path):
    assert refused(capsys, "merge", tmp_path / "nothing") == f"mapquilt: {tmp_path / 'nothing'}: no such file or folder"


def test_a_confidence_below_the_asked_is_the_reason(capsys, two_maps):
    assert command("merge", *two_maps, "--min-confidence", 0.99999999, "--json") == 1
    (pair,) = json.loads(capsys.readouterr().out)["pairs"]
    assert pair["confidence"] > 0.9
    assert pair["reason"] == f"confidence is below the asked 1, at {pair['confidence']:.6g}"


def test_one_map_alone_is_bad_input(capsys, two_maps):
    assert "one map cannot be merged" in refused(capsys, "merge", two_maps[0])


def test_one_file_under_two_names_is_bad_input(capsys, two_maps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("link.yaml").symlink_to("a.yaml")
    twice = "mapquilt: a.yaml: is given twice; a map cannot be merged with itself"
    assert refused(capsys, "merge", "a.yaml", "b.yaml", "./a.yaml") == twice
    one = "mapquilt: a.yaml and link.yaml are the same file; a map cannot be merged with itself"
    assert refused(capsys, "merge", "a.yaml", "link.yaml") == one


def test_a_folder_that_is_no_run_is_named(capsys, tmp_path):
    for verb in ("merge", "score"):
        assert str(tmp_path) in refused(capsys, verb, tmp_path)


def test_a_foreign_folder_is_never_replaced(capsys, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert str(tmp_path) in refused(capsys, "simulate", "office", "--duration", 2, "--out", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_every_map_that_cannot_be_read_is_named(capsys, two_maps, tmp_path):
    (tmp_path / "bad.yaml").write_text("image: bad.pgm\n")
    line = refused(capsys, "merge", two_maps[0], tmp_path / "bad.yaml", tmp_path / "gone.yaml")
    assert f"{tmp_path / 'bad.yaml'}: the YAML has no field resolution; " in line
    assert f"{tmp_path / 'gone.yaml'}: No such file or directory" in line


def test_a_run_is_replaced_whole_but_for_foreign_files(fresh_run, merged_run):
    (fresh_run / "note.txt").touch()
    assert command("sense", merged_run, "--noise", 2, "--out", fresh_run) == 0
    assert (fresh_run / "note.txt").exists()
    assert not (fresh_run / "merge.json").exists()
    assert [path for path in fresh_run.parent.iterdir() if path != fresh_run] == []


def test_a_folder_that_holds_an_input_is_never_replaced(capsys, fresh_run, tmp_path):
    before = hashes(fresh_run)
    (tmp_path / "link").symlink_to(fresh_run)
    log, world = fresh_run / "robot_0/log.npz", fresh_run / "mission/world.json"
    for arguments, named in (
        (("sense", fresh_run, "--out", fresh_run), fresh_run),
        (("sense", fresh_run, "--out", tmp_path / "link"), fresh_run),
        (("simulate", world, "--out", fresh_run), world),
        (("simulate", "office", "--replay", log, "--out", fresh_run), log),
        (("map", log, "--out", fresh_run), log),
        (("map", log, "--odometry", fresh_run / "o.tum", "--out", fresh_run), log),
        (("benchmark", "--pairs", fresh_run / "pairs.json", "--out", fresh_run), fresh_run / "pairs.json"),
        (("calibrate", "--dataset", fresh_run / "data", "--out", fresh_run), fresh_run / "data"),
        (("calibrate", "--pairs", fresh_run / "pairs.json", "--out", fresh_run), fresh_run / "pairs.json"),
        (("dataset", "disturb", fresh_run / "data", "--out", fresh_run), fresh_run / "data"),
    ):
        assert f"would replace the input {named}" in refused(capsys, *arguments), arguments
    assert hashes(fresh_run) == before


def test_a_dry_run_checks_options_alone(capsys, tmp_path):
    assert command("merge", tmp_path / "gone", "--method", "orb", "--dry-run") == 0
    assert "typo" in refused(capsys, "merge", tmp_path / "gone", "--method", "typo", "--dry-run")
    assert "--scale wide" in refused(capsys, "merge", tmp_path / "gone", "--scale", "wide", "--dry-run")


def test_two_copies_of_one_map_merge(capsys, two_maps, tmp_path):
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0
    written = set(hashes(tmp_path / "merged"))
    assert written == {
        *(".mapquilt-files.json", "merge.json", "merge.png", "transforms.yaml"),
        *(f"{name}.{suffix}" for name in ("merged", "conflicts") for suffix in ("pgm", "yaml")),
        *(f"inputs/{k}/{name}.{suffix}" for k, name in enumerate("ab") for suffix in ("pgm", "yaml")),
    }
    printed = capsys.readouterr().out
    assert "accepted" in printed
    assert {name for name in written if not name.startswith(("inputs/", "."))} <= set(re.split(r"[\s,]+", printed))
    assert "inputs/ (copies of 2 given maps)" in " ".join(printed.split())


def test_a_merge_without_out_says_that_nothing_was_written(capsys, two_maps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = hashes(tmp_path)
    assert command("merge", *two_maps) == 0
    assert "nothing was written; --out DIR " in capsys.readouterr().out
    assert hashes(tmp_path) == before


def test_the_transform_is_printed_as_it_is_pasted(capsys, two_maps, tmp_path):
    moved = office_map()
    frame = GridFrame(0.05, SE2(7.0, -4.0, 0.3), moved.frame.shape)
    save_map(OccupancyGrid(frame, moved.log_odds), tmp_path / "b")
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0
    header, block, matrix, *note, publisher = capsys.readouterr().out.split("\n\n")[1].splitlines()
    assert header == "# a from b: x, y [m], yaw [rad], scale"
    (group,) = yaml.safe_load((tmp_path / "merged/transforms.yaml").read_text())["groups"]
    entry = group["maps"][1]
    place = yaml.safe_load(block)
    for name in ("x", "y", "yaw", "scale"):
        assert place[name] == pytest.approx(entry[name], abs=1e-6)
    assert publisher == entry["static_transform_publisher"]
    expected = moved.frame.origin @ frame.origin.inverse()
    assert (place["x"], place["y"], place["yaw"]) == pytest.approx((expected.x, expected.y, expected.yaw), abs=0.02)
    np.testing.assert_allclose(np.array(yaml.safe_load(matrix)), entry["matrix"], atol=1e-5)
    assert len(note) == ("publish_with" in entry)
    here, there = frame.metres_from_cells(np.array([[100.0, 50.0]])), moved.frame.metres_from_cells([[100.0, 50.0]])
    np.testing.assert_allclose(np.array(entry["matrix"]) @ [*here[0], 1.0], [*there[0], 1.0], atol=0.02)


def test_every_reason_of_a_refusal_has_its_advice():
    assert set(ADVICE) == set(Reason)


@pytest.mark.slow
def test_a_refusal_ends_with_what_to_try_and_a_picture_of_the_two_placements(capsys, two_maps, tmp_path):
    save_map(office_map(2), tmp_path / "b")
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 1
    captured = capsys.readouterr()
    assert "none of 2 maps merged, frame of a" in captured.out
    assert captured.err.splitlines()[-1].endswith(str(tmp_path / "merged/refused.png"))
    assert captured.err.splitlines()[-2].startswith("mapquilt: try: ")
    (reason,) = re.findall(r"a <- b: refused: (.*)", captured.out)
    assert reason not in captured.err
    assert cv2.imread(str(tmp_path / "merged/refused.png")) is not None
    save_map(office_map(), tmp_path / "b")
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0
    assert not (tmp_path / "merged/refused.png").exists()


def test_json_is_all_that_is_printed_and_is_the_record_on_disk(capsys, two_maps, tmp_path):
    assert command("merge", *two_maps, "--json", "--out", tmp_path / "merged") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "merged/merge.json").read_text())
    assert printed["scale"] == "known"
    (pair,) = printed["pairs"]
    assert (pair["target"], pair["source"], pair["unit"]) == ("a", "b", "m")
    answer = pair["target_from_source"]
    assert (answer["x"], answer["y"], answer["yaw"]) == pytest.approx((0, 0, 0), abs=0.01)


def test_alternatives_are_listed_on_request(capsys, merged_run, tmp_path):
    maps = [merged_run / robot / "map.yaml" for robot in ("robot_0", "robot_1")]
    command("merge", *maps, "--scale", "free", "--out", tmp_path / "merged")
    assert "elsewhere" not in capsys.readouterr().out
    command("merge", *maps, "--scale", "free", "--alternatives")
    (pair,) = json.loads((tmp_path / "merged/merge.json").read_text())["pairs"]
    assert capsys.readouterr().out.count("elsewhere") == len(pair["alternatives"]) > 0


@pytest.mark.parametrize("value", ["1.5", "-0.1", "nan"])
def test_a_least_confidence_is_a_probability(capsys, two_maps, value):
    assert "--min-confidence" in refused(capsys, "merge", *two_maps, "--min-confidence", value)


def test_a_method_as_published_decides_by_itself(capsys, two_maps):
    message = refused(capsys, "merge", *two_maps, "--method", "orb", "--as-published", "--min-confidence", 0.9)
    assert "--min-confidence 0.9" in message


def test_names_are_printed_and_drawn_as_they_are(capsys, two_maps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    strange = "[/b]$\\frac$:cat:[red]/a.yaml"
    save = Path(strange).with_suffix("")
    save.parent.mkdir(parents=True)
    save_map(office_map(), save)
    assert command("merge", "a.yaml", strange, "--out", "x[/b]") == 0
    assert f"# {tmp_path.name}/a from {strange.removeprefix('[/').removesuffix('.yaml')}: " in capsys.readouterr().out
    assert command("convert", strange, "x[/b]/c.yaml") == 0
    assert capsys.readouterr().out.startswith("written: x[/b]/c.yaml and x[/b]/c.pgm, ")


def test_shifting_an_origin_moves_only_the_metric_answer(capsys, two_maps, tmp_path):
    assert command("merge", *two_maps, "--json") == 0
    before = json.loads(capsys.readouterr().out)["pairs"][0]
    moved = office_map()
    frame = GridFrame(0.05, SE2(7.0, -4.0), moved.frame.shape)
    save_map(OccupancyGrid(frame, moved.log_odds), tmp_path / "b")
    assert command("merge", *two_maps, "--json") == 0
    after = json.loads(capsys.readouterr().out)["pairs"][0]
    assert np.allclose(after["target_from_source_pixels"], before["target_from_source_pixels"], atol=1e-9)
    expected = Similarity2(**before["target_from_source"]) @ Similarity2(-8.0, 6.0)
    answer = after["target_from_source"]
    assert (answer["x"], answer["y"], answer["yaw"]) == pytest.approx((expected.x, expected.y, expected.yaw), abs=1e-6)


def test_pictures_without_yaml_merge_in_cells_with_free_scale(capsys, two_maps, tmp_path):
    picture = cv2.imread(str(tmp_path / "a.pgm"), cv2.IMREAD_GRAYSCALE)
    larger = cv2.resize(picture, None, fx=1.5, fy=1.5, interpolation=cv2.INTER_NEAREST)
    turned = cv2.rotate(larger, cv2.ROTATE_90_CLOCKWISE)
    cv2.imwrite(str(tmp_path / "turned.png"), turned)
    cv2.imwrite(str(tmp_path / "plain.png"), picture)
    out = tmp_path / "merged"
    assert command("merge", tmp_path / "plain.png", tmp_path / "turned.png", "--json", "--out", out) == 0
    captured = capsys.readouterr()
    record = json.loads(captured.out)
    assert captured.err.count("states no resolution, so its lengths are in cells") == 2
    assert (out / "merged.yaml").read_text().startswith("# plain states no resolution: ")
    assert load_map(out / "merged.yaml").grid.frame.resolution == 1.0
    (pair,) = record["pairs"]
    assert record["scale"] == "0.5:2"
    assert pair["unit"] == "cell"
    # Turned clockwise to make the source, so counter-clockwise to go back; 1.5 times larger, so 1/1.5 to go back.
    assert pair["target_from_source"]["yaw"] == pytest.approx(np.pi / 2, abs=0.01)
    assert pair["target_from_source"]["scale"] == pytest.approx(1 / 1.5, rel=0.01)
    width = turned.shape[1]
    corner = np.array(pair["target_from_source_pixels"]) @ (width - 1, 0, 1)
    assert corner == pytest.approx([0, 0], abs=1.5)


def test_maps_of_two_places_are_refused_with_a_reason(capsys, tmp_path):
    for name, seed in (("a", 1), ("b", 2)):
        save_map(office_map(seed), tmp_path / name)
    assert command("merge", tmp_path / "a.yaml", tmp_path / "b.yaml", "--scale", "free") == 1
    captured = capsys.readouterr()
    assert "refused" in captured.out
    assert "was not merged" in captured.err


def test_the_merged_map_lies_in_the_reference_frame(two_maps, tmp_path):
    assert command("merge", *two_maps, "--out", tmp_path / "merged") == 0
    merged, a = load_map(tmp_path / "merged/merged.yaml").grid, load_map(two_maps[0]).grid
    walls = a.frame.metres_from_cells(np.argwhere(a.occupied))
    cells = merged.frame.cells_from_metres(walls)
    inside = merged.frame.contains(cells)
    assert inside.mean() > 0.999
    assert merged.occupied[cells[inside, 0], cells[inside, 1]].mean() > 0.95


def test_an_internal_error_has_status_70_and_a_message(capsys, monkeypatch, merged_run):
    def broken(run):
        raise RuntimeError("the moon is made of cheese")

    monkeypatch.setattr(mapquilt.cli.verbs.score, "score_run", broken)
    assert command("score", merged_run) == 70
    assert capsys.readouterr().err.splitlines()[-1] == (
        "mapquilt: internal error: RuntimeError: the moon is made of cheese"
    )


def heed_interrupts():
    """A shell starts what runs in the background with interrupts ignored, and a child would inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def read_to(terminal, sign=None):
    """Read what a process writes on a terminal, to a sign or to the end."""
    written = b""
    while sign is None or not re.search(sign, written):
        try:
            written += os.read(terminal, 4096)
        except OSError:  # nobody holds the terminal's other side any more
            assert sign is None, written.decode()
            break
    return written


@pytest.mark.parametrize(("sign", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_killed_simulation_leaves_the_old_run_and_can_be_started_again(fresh_run, merged_run, sign, status):
    before = hashes(fresh_run)
    arguments = ["simulate", "office", "--robots", "2", "--duration", "3600", "--seed", "9", "--out", str(fresh_run)]
    terminal, errors = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "mapquilt", *arguments],
        stderr=errors,
        env=os.environ | {"TERM": "xterm"},
        preexec_fn=heed_interrupts,
    )
    os.close(errors)
    read_to(terminal, rb"[1-9]\d*/3600")  # the progress bar: the mission is under way
    process.send_signal(sign)
    assert b"Traceback" not in read_to(terminal)
    os.close(terminal)
    assert process.wait() == status
    assert hashes(fresh_run) == before
    assert command("sense", merged_run, "--out", fresh_run) == 0


@pytest.mark.parametrize("calls", [1, 3])
def test_an_interrupt_that_numba_reports_as_an_error_of_its_own_is_an_interrupt(capsys, monkeypatch, merged_run, calls):
    def interrupted(run):
        error = KeyboardInterrupt()
        for _ in range(calls):
            outer = SystemError("returned a result with an exception set")
            outer.__cause__ = error
            error = outer
        raise error

    monkeypatch.setattr(mapquilt.cli.verbs.score, "score_run", interrupted)
    assert command("score", merged_run) == 130
    assert capsys.readouterr().err == "mapquilt: interrupted\n"


INTERRUPTED_IN_GENERATED_CODE = """
import sys, types
module = types.ModuleType("mapquilt.cli.app")
module.run = lambda arguments: exec("raise KeyboardInterrupt")
sys.modules["mapquilt.cli.app"] = module
from mapquilt.__main__ import main
main()
"""


def test_an_interrupt_in_generated_code_has_the_same_status(tmp_path):
    (tmp_path / "interrupted.py").write_text(INTERRUPTED_IN_GENERATED_CODE)
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-m", "interrupted"], capture_output=True, env=environment)
    assert (done.returncode, done.stderr) == (130, b"mapquilt: interrupted\n")


def test_version_and_help(capsys):
    assert command("--version") == 0
    assert command("--help") == 0
    printed = capsys.readouterr().out
    assert printed.startswith("mapquilt 0.")
    for verb in ("simulate", "sense", "merge", "score"):
        assert verb in printed


def test_no_command_is_bad_input(capsys):
    assert "command" in refused(capsys)


def test_the_help_names_every_exit_status(capsys):
    numbers = [value for value in vars(exit_status).values() if type(value) is int]
    assert len(numbers) == 9
    assert command("--help") == 0
    listed = capsys.readouterr().out.partition("Exit status: ")[2].partition("Example")[0]
    assert {int(number) for number in re.findall(r"\b(\d+) [a-z]", listed)} == set(numbers)
