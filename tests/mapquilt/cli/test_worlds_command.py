"""`mapquilt worlds` and worlds of the user: files that they write, and refusals in one line."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from PIL import Image

from mapquilt.cli.app import run
from mapquilt.runs.open_world import open_world
from worlds.families.registry import FAMILIES, make_world
from worlds.world_file import world_from_json

WALLS = [
    {"centre": [4, 0.1], "size": [8, 0.2]},
    {"centre": [4, 4.9], "size": [8, 0.2]},
    {"centre": [0.1, 2.5], "size": [5, 0.2], "yaw": 1.5707963267948966},
    {"centre": [7.9, 2.5], "size": [0.2, 5]},
]
HALL: dict[str, Any] = {"schema": "mapquilt-world/1", "size": [8, 5], "boxes": WALLS}


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """The one line on standard error of a command that must end with exit status 2."""
    assert run([str(argument) for argument in arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    return captured.err


def save(path: Path, record: object) -> Path:
    path.write_text(json.dumps(record), encoding="utf-8")
    return path


def test_list_names_every_family_in_aligned_columns(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["worlds", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for name, family in FAMILIES.items():
        (line,) = [line for line in lines if line.split()[:1] == [name]]
        assert f"{family.width:g} x {family.height:g}" in line
        assert len(line) <= 80
        assert family.about.startswith(line[lines[1].index("what it is") :].rstrip())


@pytest.mark.parametrize("ending", ["json", "yaml"])
def test_a_written_world_is_the_generated_one_bit_for_bit(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"maze.{ending}"
    assert run(["worlds", "make", "maze", "--seed", "4", "--width", "14", "--out", str(path)]) == 0
    made = make_world("maze", 4, width=14.0)
    assert open_world(str(path), seed=0) == (made, ())
    text = path.read_text(encoding="utf-8")
    assert world_from_json(json.loads(text) if ending == "json" else yaml.safe_load(text)) == made


def test_show_draws_solids_and_starts_where_they_are(tmp_path: Path) -> None:
    bare, started = tmp_path / "bare.png", tmp_path / "started.png"
    hall = save(tmp_path / "hall.json", {**HALL, "starts": [{"x": 2, "y": 2}, {"x": 6, "y": 3}]})
    assert run(["worlds", "show", str(hall), "--robots", "0", "--out", str(bare)]) == 0
    assert run(["worlds", "show", str(hall), "--robots", "2", "--out", str(started)]) == 0
    blue = np.array((0x00, 0x72, 0xB2))
    counts = [
        int((np.abs(np.asarray(Image.open(path).convert("RGB")).astype(int) - blue).sum(axis=2) < 12).sum())
        for path in (bare, started)
    ]
    assert counts[0] == 0
    assert counts[1] > 20


def test_the_name_of_a_world_is_drawn_as_it_is(tmp_path: Path) -> None:
    hall = save(tmp_path / "hall.json", {**HALL, "name": "$\\frac$"})
    assert run(["worlds", "show", str(hall), "--out", str(tmp_path / "hall.png")]) == 0


def test_the_sheet_and_show_by_default_write_a_png(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["worlds", "show", "maze", "--seed", "3"]) == 0
    assert Image.open("maze-3.png").size[0] > 400


def test_robots_explore_a_world_file_from_its_starts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    start = {"x": 2.0, "y": 2.0, "yaw": 0.5}
    hall = save(tmp_path / "hall.json", {**HALL, "starts": [start]})
    out = tmp_path / "run"
    assert run(["simulate", str(hall), "--robots", "1", "--duration", "1", "--out", str(out)]) == 0
    assert "of hall" in capsys.readouterr().out
    assert json.loads((out / "truth.json").read_text())["robots"][0]["world_from_start"] == pytest.approx(start)
    assert json.loads((out / "run.json").read_text())["world"] == "hall"


def test_robots_explore_a_floor_plan(tmp_path: Path) -> None:
    cells = np.full((50, 80), 255, np.uint8)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, -2, -1]] = 0
    Image.fromarray(cells).save(tmp_path / "flat.png")
    arguments = ["--plan-resolution", "0.1", "--robots", "1", "--duration", "1", "--out", str(tmp_path / "run")]
    assert run(["simulate", str(tmp_path / "flat.png"), *arguments]) == 0
    world = json.loads((tmp_path / "run/mission/world.json").read_text())
    assert (world["name"], world["size"], len(world["polygons"])) == ("flat", [8.0, 5.0], 4)


def test_the_truth_of_a_run_is_a_map_that_can_be_explored(tmp_path: Path) -> None:
    hall = save(tmp_path / "hall.json", HALL)
    out = tmp_path / "run"
    assert run(["simulate", str(hall), "--robots", "1", "--duration", "1", "--out", str(out)]) == 0
    assert open_world(str(out / "truth/world.yaml"), 0)[0].size == (8.0, 5.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"polygons": [[[0, 0], [1, 1]]]}, "polygons[0]"),
        ({"polygons": [[[1, 1], [2, 2], [2, 1], [1, 2.5]]]}, "obstacle 0 crosses or touches itself"),
        ({"polygons": [[[1, 1], [9, 1], [2, 2]]]}, "leaves the world's 8.0 x 5.0 m"),
        ({"polygons": [[[1, 1], [2, float("nan")], [2, 2]]]}, "not finite"),
        ({"polygon": []}, "polygon"),
        ({"size": [8]}, "size"),
        ({"size": [800, 5]}, "width is 800 m"),
        ({"cylinders": [{"centre": [4, 2.5], "radius": 0}]}, "cylinders[0].radius"),
        ({"schema": "mapquilt-run/1"}, "schema"),
        ({"starts": [{"x": 0.1, "y": 2}]}, "start 0 at (0.1, 2) is in a wall"),
        ({"polygons": [[[4, 0], [4.2, 0], [4.2, 5], [4, 5]]]}, "in 2 parts"),
        ({"boxes": WALLS[:3]}, "could leave"),
    ],
)
def test_a_malformed_world_is_refused_by_file_and_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: dict[str, object], message: str
) -> None:
    for path in (tmp_path / "own.json", tmp_path / "own.yaml"):
        if path.suffix == ".json":
            save(path, {**HALL, **change})
        else:
            path.write_text(yaml.safe_dump({**HALL, **change}), encoding="utf-8")
        line = refusal(capsys, "simulate", path, "--out", tmp_path / "run")
        assert str(path) in line
        assert message in line
    assert not (tmp_path / "run").exists()


def png_header(width: int, height: int) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sIIBBBBBI", 13, b"IHDR", width, height, 8, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("content", [png_header(100_000, 100_000), b"P5 100000 100000 255\n"], ids=["png", "pgm"])
def test_a_huge_plan_is_refused_by_its_header(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    path = tmp_path / "huge.png"
    path.write_bytes(content)
    line = refusal(capsys, "simulate", path, "--plan-resolution", "0.01", "--out", tmp_path / "run")
    assert "100000 x 100000 pixels" in line
    assert str(path) in line


def test_plans_are_refused_with_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    black, white = tmp_path / "black.pgm", tmp_path / "white.png"
    Image.fromarray(np.zeros((30, 30), np.uint8)).save(black)
    Image.fromarray(np.full((30, 30), 255, np.uint8)).save(white)
    out = ("--out", tmp_path / "run")
    assert "no free cell" in refusal(capsys, "simulate", black, "--plan-resolution", "0.1", *out)
    assert "needs --plan-resolution" in refusal(capsys, "simulate", white, *out)
    assert "width is 3200 m" in refusal(capsys, "simulate", white, "--plan-resolution", "100", *out)
    assert "resolution is -1" in refusal(capsys, "simulate", white, "--plan-resolution=-1", *out)
    assert "no free floor" in refusal(capsys, "simulate", white, "--plan-resolution", "0.01", *out)
    assert "applies to pictures and drawings only" in refusal(
        capsys, "simulate", "maze", "--plan-resolution", "0.1", *out
    )
    assert "--width and --height" in refusal(capsys, "simulate", white, "--width", "5", *out)


def test_anything_but_a_world_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, laughs = tmp_path / "notes.txt", tmp_path / "laughs.yaml"
    text.write_text("no world")
    laughs.write_text("schema: mapquilt-world/1\nsize: &a [1, 1]\npolygons: [*a, *a]\n")
    line = refusal(capsys, "worlds", "show", "warehose")
    assert "unknown world 'warehose'; known are: office" in line
    assert line.strip().endswith("; did you mean warehouse?")
    assert "missing.json: No such file" in refusal(capsys, "worlds", "show", tmp_path / "missing.json")
    assert "is a folder" in refusal(capsys, "worlds", "show", tmp_path)
    assert "notes.txt: is no world file" in refusal(capsys, "worlds", "show", text)
    assert "it has aliases, which are not allowed" in refusal(capsys, "worlds", "show", laughs)
    assert "width is 4 m, too small" in refusal(capsys, "worlds", "show", "house", "--width", "4")
    assert "ends in .json" in refusal(capsys, "worlds", "make", "maze", "--out", tmp_path / "maze.txt")
    assert "--seed -1: must" in refusal(capsys, "worlds", "show", "maze", "--seed=-1")


def two_rooms(path: Path) -> Path:
    """A map of two rooms without a door, in cells of 0.1 m, with specks in the larger one."""
    cells = np.full((50, 90), 254, np.uint8)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, 60, 61, -2, -1]] = 0
    cells[20, 20] = cells[30, 40] = 205
    Image.fromarray(cells).save(path.with_suffix(".png"))
    path.write_text(
        f"image: {path.stem}.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
        "free_thresh: 0.196\n",
        encoding="utf-8",
    )
    return path


def test_a_real_map_becomes_a_world_that_says_what_was_mended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan, out = two_rooms(tmp_path / "flat.yaml"), tmp_path / "flat.json"
    assert "worlds make --from-map" in refusal(capsys, "worlds", "make", plan, "--out", out)
    assert not out.exists()
    assert run(["worlds", "make", "--from-map", str(plan), "--out", str(out)]) == 0
    err = capsys.readouterr().err
    assert f"{plan}: dropped 2 solid specks of at most 1 cell" in err
    assert "1 part of the floor that robots of 0.2 m radius cannot reach: 12.0 m^2 of 38.6 m^2" in " ".join(err.split())
    world, notes = open_world(str(out), seed=0)
    assert notes == ()
    assert world.clearance([(2.05, 2.95)]) == pytest.approx([1.85])
    assert world.fault_at(7.0, 2.0) == "in a wall of world 'flat'"
    picture = tmp_path / "flat-world.png"
    assert run(["worlds", "show", str(plan), "--from-map", "--out", str(picture)]) == 0
    assert picture.stat().st_size > 1000


def test_a_level_of_a_building_is_chosen_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    corners = [[0, 0, 0, ""], [6, 0, 0, ""], [6, 4, 0, ""], [0, 4, 0, ""], [0, 8, 0, ""], [6, 8, 0, ""]]
    low, high = (
        {"vertices": corners, "walls": walls}
        for walls in ([[0, 1], [1, 2], [2, 3], [3, 0]], [[0, 1], [1, 5], [5, 4], [4, 0]])
    )
    path = tmp_path / "clinic.building.yaml"
    record = {"name": "clinic", "coordinate_system": "cartesian_meters", "levels": {"L1": low, "L2": high}}
    path.write_text(json.dumps(record), encoding="utf-8")
    out = tmp_path / "clinic.json"
    assert "has 2 levels: L1, L2" in refusal(capsys, "worlds", "make", path, "--out", out)
    assert run(["worlds", "make", str(path), "--level", "L2", "--out", str(out)]) == 0
    capsys.readouterr()
    assert open_world(str(out), 0)[0].size == pytest.approx((6.3, 8.3))
    assert "--level: applies to buildings only" in refusal(capsys, "worlds", "make", out, "--level", "L2", "--out", out)


def test_options_of_plans_are_refused_for_families(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "maze.json"
    assert "--from-map and --level" in refusal(capsys, "worlds", "make", "maze", "--from-map", "--out", out)
    assert "--from-map and --level" in refusal(capsys, "worlds", "make", "maze", "--level", "L1", "--out", out)


def test_draft_writes_the_picture_of_its_seeds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["worlds", "draft", "house", "--seed", "2", "--style", "grey", "--out"]
    assert run([*words, str(tmp_path / "a.png"), "--drawing", "1"]) == 0
    assert run([*words, str(tmp_path / "new" / "b.png"), "--drawing", "1"]) == 0
    assert run([*words, str(tmp_path / "c.png"), "--drawing", "2"]) == 0
    first, same, other = ((tmp_path / name).read_bytes() for name in ("a.png", "new/b.png", "c.png"))
    assert first == same != other
    assert "house, grey" in capsys.readouterr().out


def test_draft_refuses_an_unknown_style_and_another_ending(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = tmp_path / "plan.png"
    assert "--style 'gray': must be one of hollow" in refusal(
        capsys, "worlds", "draft", "house", "--style", "gray", "--out", plan
    )
    assert "must end in .png" in refusal(capsys, "worlds", "draft", "house", "--out", tmp_path / "plan.jpg")
    assert not plan.exists()
