"""`merge --method morphology --debug DIR`: every step as a picture, and the numbers."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import save_map
from tests.conftest import command
from tests.mapquilt.cli.test_app import refused
from tests.merge.literature.crisp import crisp_pair

STEPS = [
    "1-map",
    "2-walls",
    "3-direction",
    "4-straightened",
    "5-closed",
    "6-interest-points",
    "7-main-structure",
    "8-corners",
]


@pytest.fixture(scope="module")
def two_maps(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maps")
    for name, prepared in zip("ab", crisp_pair()[:2], strict=True):
        save_map(prepared.grid, folder / name)
    return folder / "a.yaml", folder / "b.yaml"


@pytest.fixture(scope="module")
def debug(two_maps, tmp_path_factory):
    out = tmp_path_factory.mktemp("debug") / "steps"
    assert command("merge", *two_maps, "--method", "morphology", "--debug", out) == 0
    return out


def test_every_step_of_every_map_is_a_picture(debug):
    for folder in ("0-a", "1-b"):
        assert sorted(path.stem for path in (debug / folder).iterdir()) == STEPS
        pictures = {path.stem: cv2.imread(str(path)) for path in (debug / folder).iterdir()}
        assert all(picture.std() > 0.0 for picture in pictures.values())
        walls, structure = (np.count_nonzero(pictures[step]) for step in ("2-walls", "7-main-structure"))
        assert 0 < structure < walls
    assert (debug / "0-1-matches.png").stat().st_size > 10_000
    assert (debug / "steps.png").stat().st_size > 10_000


def test_the_numbers_describe_the_alignment(debug):
    record = json.loads((debug / "steps.json").read_text(encoding="utf-8"))
    a, b = record["maps"]
    assert a["turned"]
    assert b["turned"]
    (pair,) = record["pairs"]
    best = pair["quarters"][0]
    # Directions are in pictures, v down: their sign is the other one.
    off = (b["direction_deg"] - a["direction_deg"] - best["yaw_deg"] + 45.0) % 90.0 - 45.0
    assert abs(off) < 0.6
    assert best["index"] > 0.95
    assert all(quarter["index"] < best["index"] for quarter in pair["quarters"][1:])


def test_the_same_call_gives_the_same_bytes_and_replaces_its_output(debug, two_maps):
    before = {path.relative_to(debug): path.read_bytes() for path in debug.rglob("*") if path.is_file()}
    assert command("merge", *two_maps, "--method", "morphology", "--debug", debug) == 0
    assert {path.relative_to(debug): path.read_bytes() for path in debug.rglob("*") if path.is_file()} == before


def test_a_map_without_a_main_direction_gives_a_warning(tmp_path, capfd):
    rows, cols = np.mgrid[0:160, 0:160] - 80
    ring = np.abs(np.hypot(rows, cols) - 60.0)
    for name in ("a", "b"):
        cells = np.where(ring < 2.0, 1.0, np.where(np.hypot(rows, cols) < 60.0, -1.0, 0.0)).astype(np.float32)
        save_map(OccupancyGrid(GridFrame(0.05, SE2(), cells.shape), cells), tmp_path / name)
    assert command("merge", tmp_path / "a.yaml", tmp_path / "b.yaml", "--method", "morphology") in (0, 1)
    printed = capfd.readouterr().err
    assert "warning: a: no main direction (sharpness" in printed
    assert "not rotated" in printed


def test_other_methods_have_no_steps(two_maps, tmp_path, capfd):
    out = tmp_path / "steps"
    printed = refused(capfd, "merge", *map(str, two_maps), "--debug", str(out))
    assert printed == f"mapquilt: --debug {out}: only --method morphology has steps to show, not quilt"
    assert not out.exists()


def test_a_foreign_folder_is_refused(two_maps, tmp_path, capfd):
    (tmp_path / "dear.txt").write_text("hello", encoding="utf-8")
    printed = refused(capfd, "merge", *map(str, two_maps), "--method", "morphology", "--debug", str(tmp_path))
    assert "refusing to replace it" in printed
    assert [path.name for path in tmp_path.iterdir()] == ["dear.txt"]
