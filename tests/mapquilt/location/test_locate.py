"""`mapquilt locate`: the right plan at the right place, at most one, or none; refusals in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapping.io.picture import Picture, picture_bytes
from mapquilt.cli.app import run
from mapquilt.json_file import read_record
from mapquilt.location.locate import LocationSettings, locate
from mapquilt.location.plan_picture import PlanPicture, read_plans
from worlds.drafting.drafting import draft_plan
from worlds.families.registry import make_world
from worlds.importing.drawn_walls import find_walls
from worlds.raster import true_raster

MAZES = (3, 4)


def scan_of(seed: int, world_from_map: SE2) -> OccupancyGrid:
    """The true raster of a maze as a map in a frame of its own."""
    truth = true_raster(make_world("maze", seed, 10.0, 8.0), 0.05)
    rows, cols = truth.frame.shape
    frame = GridFrame(0.05, world_from_map.inverse(), (rows, cols))
    return OccupancyGrid.from_occupancy(frame, np.where(truth.occupied, OCCUPIED, FREE))


POSE = SE2(3.0, -1.0, 0.7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan, the plans of two mazes, and a second drawing of the right one."""
    root = tmp_path_factory.mktemp("plans")
    save_map(scan_of(MAZES[0], POSE), root / "scan")
    for name, seed, style, drawing in (("a", 3, "hollow", 1), ("b", 4, "solid", 2), ("c", 3, "hatched", 3)):
        plan = draft_plan(make_world("maze", seed, 10.0, 8.0), style, drawing)
        (root / f"{name}.png").write_bytes(picture_bytes(Picture(plan.grey), "png"))
    return root


def error_of(found: Similarity2, truth: Similarity2) -> tuple[float, float, float]:
    """Largest displacement of the building's corners [m of the scan], rotation [rad] and scale."""
    corners = POSE.inverse().apply(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 8.0), (0.0, 8.0)]))
    shift = np.hypot(*(found.apply(corners) - truth.apply(corners)).T).max() / truth.scale
    return float(shift), abs(found.yaw - truth.yaw), found.scale / truth.scale


def test_the_right_plan_is_named_at_the_true_place(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "found"
    assert (
        run(["locate", *map(str, (folder / "scan.yaml", folder / "b.png", folder / "a.png")), "--out", str(out)]) == 0
    )
    assert "the map lies on a" in capsys.readouterr().out
    record = read_record(out / "location.json", "location")
    assert record["plan"] == "a"
    best, other = record["plans"]
    assert (best["name"], other["name"]) == ("a", "b")
    assert best["confidence"] > 0.6 > other["confidence"]
    frame = draft_plan(make_world("maze", 3, 10.0, 8.0), "hollow", 1).frame
    origin = frame.origin
    truth = Similarity2(origin.x, origin.y, origin.yaw, frame.resolution).inverse() @ Similarity2(
        POSE.x, POSE.y, POSE.yaw
    )
    place = Similarity2(**{name: best["plan_from_scan"][name] for name in ("x", "y", "yaw", "scale")})
    shift, turn, scale = error_of(place, truth)
    assert shift < 0.1
    assert turn < 0.01
    assert abs(scale - 1.0) < 0.01
    assert best["scan_per_pixel"] == pytest.approx(frame.resolution, rel=0.01)
    # The pixel matrix says the same as the transform, for pictures: y down, centres at integers.
    scan = load_map(folder / "scan.yaml").grid
    metre = scan.frame.metre_from_pixel() @ (10.0, 20.0, 1.0)
    x, y = place.apply(metre[None, :2])[0]
    with Image.open(folder / "a.png") as picture:
        height = picture.size[1]
    np.testing.assert_allclose(np.array(best["plan_from_scan_pixels"]) @ (10.0, 20.0, 1.0), (x - 0.5, height - 0.5 - y))
    assert load_map(out / "plan.yaml").grid.frame.resolution == pytest.approx(
        best["scan_per_pixel"] * max(1, round(_thickness(folder / "a.png") / 3.0))
    )


def _thickness(path: Path) -> float:
    (plan,) = read_plans([path])
    return plan.walls.thickness


def test_a_map_of_another_place_gets_no_plan(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "none"
    assert run(["locate", str(folder / "scan.yaml"), str(folder / "b.png"), "--out", str(out)]) == 1
    assert "none of 1 plan is named" in capsys.readouterr().out
    assert json.loads((out / "location.json").read_text())["plan"] is None
    assert not (out / "plan.yaml").exists()


def test_two_plans_of_one_place_share_the_confidence_and_none_is_named(folder: Path) -> None:
    scan = load_map(folder / "scan.yaml").grid
    one, two = read_plans([folder / "a.png", folder / "c.png"])
    alone = {each.name: locate(scan, [each])[0].confidence for each in (one, two)}
    assert min(alone.values()) > 0.6
    both = locate(scan, [one, two])
    assert sum(each.confidence for each in both) < 1.0
    assert all(each.confidence < alone[each.plan.name] for each in both)
    assert both[0].confidence <= 0.6
    assert [each.reason for each in both] == ["fits, but so does " + each.plan.name for each in both[::-1]]


def test_the_order_of_plans_changes_nothing(folder: Path) -> None:
    scan = load_map(folder / "scan.yaml").grid
    plans = read_plans([folder / "a.png", folder / "b.png"])
    there, back = ([(one.plan.name, one.confidence) for one in locate(scan, each)] for each in (plans, plans[::-1]))
    assert there == back


def test_a_known_resolution_gives_metres(folder: Path) -> None:
    scan = load_map(folder / "scan.yaml").grid
    frame = draft_plan(make_world("maze", 3, 10.0, 8.0), "hollow", 1).frame
    (found,) = locate(scan, read_plans([folder / "a.png"]), LocationSettings(plan_resolution=frame.resolution))
    assert found.reason is None
    assert found.unit == "m"
    assert found.plan_from_scan is not None
    assert found.plan_from_scan.scale == pytest.approx(1.0, abs=0.01)


def test_a_large_picture_is_searched_smaller_and_placed_in_its_own_pixels() -> None:
    plan = draft_plan(make_world("maze", 3, 10.0, 8.0), "solid", 1)
    small = PlanPicture("p", Path("p.png"), plan.grey, find_walls(plan.grey))
    large = PlanPicture("p", Path("p.png"), np.kron(plan.grey, np.ones((2, 2), np.uint8)), small.walls, shrunk=2)
    scan = scan_of(3, POSE)
    (one,), (two,) = locate(scan, [small]), locate(scan, [large])
    assert one.plan_from_scan is not None
    assert two.plan_from_scan is not None
    assert two.plan_from_scan.scale == pytest.approx(2.0 * one.plan_from_scan.scale)
    assert two.plan_from_scan.x == pytest.approx(2.0 * one.plan_from_scan.x)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("scan.yaml", "missing.png"), "missing.png"),
        (("scan.yaml", "scan.yaml"), "scan.yaml: is no picture of a plan, must end in one of .png"),
        (("scan.yaml", "a.png", "a.png"), "a.png: is given twice"),
        (("scan.yaml", "."), "is a folder; name the pictures in it"),
        (("scan.yaml", "white.png"), "white.png: nothing is drawn in the picture"),
        (("scan.yaml", "a.png", "--scale", "0.9:1.1"), "--scale 0.9:1.1: needs --plan-resolution"),
        (("scan.yaml", "a.png", "--plan-resolution", "0"), "--plan-resolution 0: must be positive"),
        (("scan.yaml", "a.png", "--plan-resolution", "0.02", "--scale", "2:1"), "--scale 2:1: must be LO:HI"),
        (("scan.pgm", "a.png", "--plan-resolution", "0.02"), "--plan-resolution 0.02: gives no scale"),
        (("scan.yaml", "a.png", "--out", "."), "would replace the input"),
        (("scan.yaml", "a.png", "--min-confidence", "1.5"), "--min-confidence 1.5: must lie between 0 and 1"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    (folder / "white.png").write_bytes(picture_bytes(Picture(np.full((100, 100), 255, np.uint8)), "png"))
    before = sorted(folder.rglob("*"))
    files = [str(folder / each) if each[0] in "samw." else each for each in arguments]
    assert run(["locate", *files]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert sorted(folder.rglob("*")) == before
