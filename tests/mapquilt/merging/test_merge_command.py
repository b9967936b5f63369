"""Options of `mapquilt merge` for teams, and their records."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from mapping.geometry.scale_range import ScaleRange
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapping.map_set import MapSet
from mapquilt.cli.options.merge import parse_priors
from mapquilt.json_file import OLD_EVIDENCE, read_record
from mapquilt.leaves import with_assignments
from mapquilt.merging.merge_again import settings_before
from mapquilt.merging.merge_file import MergeTree, merge_record
from mapquilt.merging.merge_inputs import MergeInputs
from mapquilt.merging.transforms_file import transforms_text
from merge.records.prior import Prior
from merge.records.result import MergedGroup, MergeResult
from merge.settings import MergeSettings
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import office_map, refused
from tests.merge.test_merger import team


@pytest.fixture(scope="module")
def maps_of_three(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    maps, _ = team(8, 3)
    folder = tmp_path_factory.mktemp("three")
    for name, grid in zip(maps.names, maps.grids, strict=True):
        save_map(grid, folder / name)
    return [folder / f"{name}.yaml" for name in maps.names]


@pytest.fixture(scope="module")
def merged_two(maps_of_three: list[Path]) -> Path:
    out = maps_of_three[0].parent / "out"
    assert command("merge", *maps_of_three[:2], "--out", out) == 0
    return out


def record(folder: Path) -> dict:
    return json.loads((folder / "merge.json").read_text())


def test_adding_a_map_equals_merging_all_and_matches_only_new_pairs(
    maps_of_three: list[Path], merged_two: Path, tmp_path: Path, monkeypatch
) -> None:
    matched = []
    whole = tmp_path / "whole"
    assert command("merge", *maps_of_three, "--reference", record(merged_two)["reference"], "--out", whole) == 0

    from merge import merger as module

    real = module.match
    monkeypatch.setattr(module, "match", lambda task, cache=None: matched.append(task.names) or real(task, cache))
    assert command("merge", merged_two, "--add", maps_of_three[2]) == 0
    assert sorted(matched) == [("a", "c"), ("b", "c")]
    added, at_once = record(merged_two), record(whole)
    assert [pair["target_from_source"] for pair in added["pairs"]] == [
        pair["target_from_source"] for pair in at_once["pairs"]
    ]
    for one, other in zip(added["maps"], at_once["maps"], strict=True):
        np.testing.assert_allclose(
            list(one["reference_from_map"].values()), list(other["reference_from_map"].values()), atol=1e-6
        )
    assert (merged_two / added["maps"][2]["file"]).read_bytes() == maps_of_three[2].read_bytes()

    grown = tmp_path / "c.yaml"
    grid = load_map(maps_of_three[2]).grid
    save_map(type(grid)(grid.frame, np.where(np.arange(grid.frame.shape[1]) < 60, 0, grid.log_odds)), tmp_path / "c")
    matched.clear()
    assert command("merge", merged_two, "--add", grown) == 0
    assert sorted(matched) == [("a", "c"), ("b", "c")]
    assert [entry["name"] for entry in record(merged_two)["maps"]] == ["a", "b", "c"]


@pytest.fixture
def two(maps_of_three: list[Path], tmp_path: Path) -> Path:
    """A merge of two maps with settings of its own, to be extended."""
    options = ("--method", "orb", "--scale", "0.9:1.1", "--fusion", "max", "--reference", "b", "--seed", 3)
    more = ("--min-confidence", 0.5, "--prior", "a:0,0,-0.5,50", "--set", "acceptance.min_overlap=0.05")
    assert command("merge", *maps_of_three[:2], *options, *more, "--out", tmp_path / "two") == 0
    return tmp_path / "two"


KEPT = ("method", "scale", "seed", "min_confidence", "fusion", "reference", "reference_requested", "priors", "settings")


def test_adding_a_map_keeps_every_recorded_setting(two: Path, maps_of_three: list[Path]) -> None:
    before = record(two)
    assert before["settings"] == {"merge.acceptance.min_overlap": 0.05}
    assert command("merge", two, "--add", maps_of_three[2]) in (0, 1)
    assert {name: record(two)[name] for name in KEPT} == {name: before[name] for name in KEPT}


def test_a_setting_said_anew_replaces_the_recorded_one(two: Path, maps_of_three: list[Path], capsys) -> None:
    options = ("--fusion", "least_entropy", "--reference", "a", "--seed", 4, "--method", "quilt")
    more = ("--prior", "b:0,0,0.0,60", "--set", "acceptance.min_overlap=0.06")
    before = record(two)
    assert command("merge", two, "--add", maps_of_three[2], *options, *more) in (0, 1)
    after = record(two)
    assert [after[name] for name in ("fusion", "reference", "seed", "method")] == ["least_entropy", "a", 4, "quilt"]
    assert {prior["name"]: prior["sigma"] for prior in after["priors"]} == {"a": 50.0, "b": 60.0}
    assert after["settings"] == {"merge.acceptance.min_overlap": 0.06}
    assert (after["scale"], after["min_confidence"]) == (before["scale"], before["min_confidence"])
    assert "the frame of the answer is now that of a, and no longer that of b" in capsys.readouterr().err


@pytest.mark.parametrize(
    "settings",
    [
        MergeSettings(),
        MergeSettings(method="sift", as_published=True, scale=ScaleRange(0.8, 1.25), reference="a"),
        MergeSettings(priors=(Prior("a", 1.0, 2.0, 3.0), Prior("b", 0.0, 0.0, 0.0, 2.0)), fusion="max"),
        with_assignments(
            MergeTree(),
            "--set",
            (
                "uncertainty.max_points=99",
                "alignment.overlap.tolerance_shares=0.02:0.01",
                "acceptance.min_confidence=0.7",
            ),
        ).merge,
    ],
)
def test_recorded_settings_are_read_back(settings: MergeSettings) -> None:
    grid = office_map()
    maps = MapSet(("a", "b"), (grid, grid), ("m", "m"))
    inputs = MergeInputs(maps, ("a.yaml", "b.yaml"), (None, None))
    empty = OccupancyGrid(grid.frame, np.zeros(grid.frame.shape))
    result = MergeResult(maps.names, (), (MergedGroup("a", {"a": Similarity2()}, grid, empty),))
    written = json.loads(json.dumps(merge_record(inputs, settings, 0, result)))
    kept = "a" if settings.reference or not settings.priors or "a" in {p.name for p in settings.priors} else None
    assert settings_before(written, True) == dataclasses.replace(settings, reference=kept)


def test_a_merge_that_joins_less_is_only_written_by_force(
    merged_two: Path, maps_of_three: list[Path], tmp_path: Path, capsys
) -> None:
    """Map b grows to one that shows nothing: it no longer joins a."""
    out = tmp_path / "out"
    shutil.copytree(merged_two, out)
    before, grid = hashes(out), load_map(maps_of_three[1]).grid
    save_map(OccupancyGrid(grid.frame, np.where(grid.known, np.float32(-1.0), grid.log_odds)), tmp_path / "b")
    capsys.readouterr()
    assert command("merge", out, "--add", tmp_path / "b.yaml") == 1
    assert f"{out}: was not changed, because a and b are merged there" in capsys.readouterr().err
    assert hashes(out) == before
    assert command("merge", out, "--add", tmp_path / "b.yaml", "--force") == 1
    assert len(record(out)["groups"][0]["maps"]) < len(
        json.loads((merged_two / "merge.json").read_text())["groups"][0]["maps"]
    )


def test_a_record_of_the_first_schema_is_read_with_the_new_names(merged_two: Path, tmp_path: Path) -> None:
    new = record(merged_two)
    old = json.loads(json.dumps(new)) | {"schema": "mapquilt-merge/1"}
    for pair in old["pairs"]:
        pair["evidence"] = {before: pair["evidence"][after] for before, after in OLD_EVIDENCE.items()} | {
            name: value for name, value in pair["evidence"].items() if name not in OLD_EVIDENCE.values()
        }
        for other in pair["alternatives"]:
            other["agreement"] = other.pop("score")
    (tmp_path / "merge.json").write_text(json.dumps(old))
    assert "walls_on_walls" in old["pairs"][0]["evidence"]
    assert read_record(tmp_path / "merge.json", "merge") == new


def test_a_run_takes_another_map_and_is_scored_on_its_own(fresh_run: Path, tmp_path: Path) -> None:
    save_map(load_map(fresh_run / "robot_0/map.yaml").grid, tmp_path / "again")
    assert command("merge", fresh_run, "--add", tmp_path / "again.yaml") in (0, 1)
    assert [entry["name"] for entry in record(fresh_run)["maps"]] == ["robot_0", "robot_1", "again"]
    assert command("score", fresh_run) == 0
    score = json.loads((fresh_run / "score.json").read_text())
    assert [(pair["target"], pair["source"]) for pair in score["pairs"]] == [("robot_0", "robot_1")]
    assert command("merge", fresh_run) in (0, 1)
    assert not (fresh_run / "inputs").exists() or not list((fresh_run / "inputs").iterdir())


def test_adding_to_anything_but_a_merge_is_refused(capsys, tmp_path: Path, maps_of_three: list[Path]) -> None:
    (tmp_path / "empty").mkdir()
    line = refused(capsys, "merge", tmp_path / "empty", "--add", maps_of_three[0])
    assert f"{tmp_path / 'empty'}: holds no merge to add to" in line
    assert "must follow one folder" in refused(capsys, "merge", *maps_of_three[:2], "--add", maps_of_three[2])


@pytest.mark.parametrize(
    ("option", "says"),
    [
        (("--prior", "a:1,2"), "--prior a:1,2: must be NAME:X,Y,YAW"),
        (("--prior", "a:1,2,90"), "--prior a:1,2,90: prior of a: yaw is 90 rad, must lie within a turn"),
        (("--prior", "a:1,2,90grad"), "--prior a:1,2,90grad: '90grad' is no number"),
        (("--prior", "a:1,2,x"), "--prior a:1,2,x: 'x' is no number"),
        (("--prior", "a:1,2,0,-1"), "sigma is -1"),
        (("--prior", "a:1,2,0", "--reference", "a"), "that of a alone says nothing"),
        (("--prior", "z:1,2,0", "--reference", "a"), "--prior 'z': must be the name of a map"),
        (("--reference", "z"), "--reference 'z': must be the name of a map: a, b"),
        (("--fusion", "mean"), "--fusion mean: must be one of log_odds, least_entropy, max"),
        (("--workers", "0"), "0"),
    ],
)
def test_bad_options_are_refused_in_one_line(capsys, maps_of_three: list[Path], option, says: str) -> None:
    assert says in refused(capsys, "merge", *maps_of_three[:2], *option)


def test_reference_fusion_and_priors_are_used_and_recorded(maps_of_three: list[Path], tmp_path: Path) -> None:
    options = ("--reference", "b", "--fusion", "max", "--prior", "a:0,0,-0.5,20")
    assert command("merge", *maps_of_three[:2], *options, "--out", tmp_path / "out") == 0
    merged = record(tmp_path / "out")
    assert (merged["reference"], merged["fusion"]) == ("b", "max")
    assert merged["priors"] == [{"name": "a", "x": 0.0, "y": 0.0, "yaw": -0.5, "sigma": 20.0}]


@pytest.mark.parametrize(
    ("text", "yaw"), [("90deg", math.pi / 2.0), ("-450deg", -math.pi / 2.0), ("1.5", 1.5), ("360deg", 0.0)]
)
def test_a_yaw_may_be_in_degrees(text: str, yaw: float) -> None:
    (prior,) = parse_priors([f"a:1,2,{text},0.5"])
    assert (prior.x, prior.y, prior.yaw, prior.sigma) == (1.0, 2.0, pytest.approx(yaw, abs=1e-12), 0.5)


def test_stitched_maps_are_marked_as_unverified(maps_of_three: list[Path], tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    priors = ("--prior", "a:0,0,0", "--prior", "b:3,4,90deg")
    assert command("merge", *maps_of_three[:2], "--trust-priors", *priors, "--out", out) == 0
    printed = capsys.readouterr().out
    assert "unverified" in printed and "not verified: stitched at the given start poses" in printed
    (pair,) = record(out)["pairs"]
    assert (pair["decided_by"], pair["accepted"], pair["confidence"]) == ("trusted_prior", True, 0.0)
    found = pair["target_from_source"]
    assert (found["x"], found["y"], found["yaw"], found["scale"]) == pytest.approx((3.0, 4.0, math.pi / 2.0, 1.0))
    assert record(out)["settings"] == {"merge.trust_priors": True}
    assert "c has none; give --prior c:X,Y,YAW" in refused(capsys, "merge", out, "--add", maps_of_three[2])
    assert command("merge", out, "--add", maps_of_three[2], "--prior", "c:1,2,0") == 0
    assert [pair["decided_by"] for pair in record(out)["pairs"]] == ["trusted_prior"] * 3


def test_a_single_prior_is_in_the_frame_of_the_first_other_map(maps_of_three: list[Path], tmp_path: Path) -> None:
    for name, prior in (("alone", "b:3,4,90deg"), ("both", "b:3,4,90deg")):
        options = () if name == "alone" else ("--reference", "a")
        out = tmp_path / name
        assert command("merge", *maps_of_three[:2], "--trust-priors", "--prior", prior, *options, "--out", out) == 0
    alone, both = (record(tmp_path / name)["pairs"] for name in ("alone", "both"))
    assert alone == both
    assert command("merge", *maps_of_three[:2], "--prior", "a:0,0,-0.5,20", "--out", tmp_path / "of_the_first") == 0
    assert command("merge", tmp_path / "of_the_first", "--add", maps_of_three[2]) == 0


def test_workers_write_the_same_bytes(maps_of_three: list[Path], tmp_path: Path) -> None:
    for workers in (1, 2):
        assert command("merge", *maps_of_three, "--workers", workers, "--out", tmp_path / str(workers)) == 0
    assert hashes(tmp_path / "1") == hashes(tmp_path / "2")


def test_the_published_transform_is_that_of_the_merge(maps_of_three: list[Path], merged_two: Path) -> None:
    (group,) = yaml.safe_load((merged_two / "transforms.yaml").read_text())["groups"]
    lines = [entry.get("static_transform_publisher") for entry in group["maps"]]
    assert sum(line is None for line in lines) == 1
    for entry, line in zip(group["maps"], lines, strict=True):
        if line is not None:
            x, y, yaw = (float(re.search(rf"--{name} (\S+)", line)[1]) for name in ("x", "y", "yaw"))
            assert (x, y, yaw) == pytest.approx((entry["x"], entry["y"], entry["yaw"]), abs=1e-5)
            assert f"--frame-id {group['reference']}/map --child-frame-id {entry['name']}/map" in line


def test_a_map_of_another_scale_is_published_in_the_metres_of_the_reference() -> None:
    from mapping.map_set import MapSet
    from merge.records.result import MergedGroup, MergeResult

    grid = office_map()
    maps = MapSet(("a", "b"), (grid, grid), ("m", "m"))
    place = Similarity2(1.0, -2.0, 0.5, 2.0)
    group = MergedGroup("a", {"a": Similarity2(), "b": place}, grid, grid)
    (entry,) = yaml.safe_load(transforms_text(maps, MergeResult(maps.names, (), (group,))))["groups"]
    served = entry["maps"][1]["publish_with"]
    corner = np.array([grid.frame.origin.x, grid.frame.origin.y])
    rigid = Similarity2(place.x, place.y, place.yaw)
    np.testing.assert_allclose(rigid.apply(np.array(served["origin"][:2])), place.apply(corner), atol=1e-9)
    assert served["resolution"] == pytest.approx(2.0 * grid.frame.resolution)


def test_maps_in_cells_are_published_neither_in_metres_nor_to_tf() -> None:
    grid = office_map()
    maps = MapSet(("a", "b"), (grid, grid), ("cell", "cell"))
    group = MergedGroup("a", {"a": Similarity2(), "b": Similarity2(1.0, -2.0, 0.5, 2.0)}, grid, grid)
    (entry,) = yaml.safe_load(transforms_text(maps, MergeResult(maps.names, (), (group,))))["groups"]
    assert entry["unit"] == "cell"
    assert entry["maps"][1].keys() == {"name", "x", "y", "yaw", "scale", "matrix"}


def test_frames_of_maps_in_folders_are_such_that_tf_takes_them() -> None:
    grid = office_map()
    maps = MapSet(("/tmp/a b/map", "b/map"), (grid, grid), ("m", "m"))
    group = MergedGroup(maps.names[0], {maps.names[0]: Similarity2(), "b/map": Similarity2(-1e-9)}, grid, grid)
    (entry,) = yaml.safe_load(transforms_text(maps, MergeResult(maps.names, (), (group,))))["groups"]
    line = entry["maps"][1]["static_transform_publisher"]
    assert "--x 0.000000 " in line
    assert line.endswith("--frame-id tmp/a_b/map/map --child-frame-id b/map/map")


def test_a_map_that_is_replaced_is_named(maps_of_three: list[Path], tmp_path: Path, capsys) -> None:
    folder = tmp_path / "merge"
    assert command("merge", *maps_of_three[:2], "--out", folder) == 0
    capsys.readouterr()
    newer = tmp_path / "newer" / maps_of_three[1].name
    newer.parent.mkdir()
    save_map(load_map(maps_of_three[2]).grid, newer.with_suffix(""))
    command("merge", folder, "--add", newer, "--add", maps_of_three[2], "--force")
    captured = capsys.readouterr()
    assert f"warning: {newer}: replaces the map {newer.stem} of the merge" in captured.err
    assert "replaces the map" not in captured.err.replace(f"{newer}: replaces", "")
    assert "inputs/ (copies of 2 given maps)" in " ".join(captured.out.split())
