"""`mapquilt merge --elastic`: files, record and table, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapquilt.json_file import similarity_from_record
from mapquilt.merging.merge_file import read_bend
from merge.fusion import fuse
from merge.records.bend import Bend
from merge.records.bent_map import bent_grid
from tests.conftest import command, hashes
from tests.mapquilt.cli.test_app import office_map, refused


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A map, and the same along an arc of up to 6 cells."""
    folder, grid = tmp_path_factory.mktemp("maps"), office_map(3)
    grid = OccupancyGrid(GridFrame(0.05, SE2.identity(), grid.frame.shape), grid.log_odds)
    rows, cols = grid.frame.shape
    row = np.arange(0, rows + 20, 20.0)
    nodes = np.zeros((len(row), 2 + cols // 20, 2))
    nodes[..., 0] = (9.0 * ((2.0 * row / rows - 1.0) ** 2 - 1.0 / 3.0))[:, None]
    save_map(grid, folder / "a")
    save_map(Bend(np.zeros(2), 20.0, nodes).resample(grid), folder / "b")
    return folder / "a.yaml", folder / "b.yaml"


@pytest.fixture(scope="module")
def bent(maps: tuple[Path, Path]) -> Path:
    out = maps[0].parent / "bent"
    assert command("merge", *maps, "--trust-priors", "--elastic", "--out", out) == 0
    return out


def record(folder: Path) -> dict:
    return json.loads((folder / "merge.json").read_text())


def test_the_record_says_how_the_merged_map_was_made(maps: tuple[Path, Path], bent: Path) -> None:
    """Bends and transforms of merge.json, applied to the files of the maps, give the file of the merged map."""
    written = record(bent)
    assert written["elastic"] is True
    (group,) = written["groups"]
    assert group["conflict_cells"] < 0.5 * group["rigid_conflict_cells"]
    bends = {entry["name"]: read_bend(entry) for entry in group["bends"]}
    assert "b" in bends
    for entry in group["bends"]:
        assert entry["strain"] == pytest.approx(bends[entry["name"]].strain)
        assert 0.0 < entry["largest_bend"] < 0.6
    grids = {path.stem: load_map(path).grid for path in maps}
    placed = {entry["name"]: similarity_from_record(entry["reference_from_map"]) for entry in group["maps"]}
    again = fuse(
        grids["a"].cropped().frame,
        [
            (placed[name], bent_grid(grid, bends[name].bend) if name in bends else grid.cropped())
            for name, grid in grids.items()
        ],
    )
    assert np.array_equal(load_map(bent / "merged.yaml").grid.occupancy(), again.occupancy())


def test_a_merge_without_bends_removes_their_picture(maps: tuple[Path, Path], bent: Path, tmp_path: Path) -> None:
    assert (bent / "elastic.png").stat().st_size > 10_000
    assert command("merge", *maps, "--trust-priors", "--elastic", "--out", tmp_path / "out") == 0
    assert hashes(tmp_path / "out") == hashes(bent)
    assert command("merge", *maps, "--trust-priors", "--out", tmp_path / "out") == 0
    assert not (tmp_path / "out" / "elastic.png").exists()
    written = record(tmp_path / "out")
    assert written["elastic"] is False
    assert written["groups"][0]["rigid_conflict_cells"] is None
    transforms = [entry["reference_from_map"] for entry in written["maps"]]
    assert transforms == [entry["reference_from_map"] for entry in record(bent)["maps"]]


def test_an_added_map_keeps_the_merge_elastic(maps: tuple[Path, Path], bent: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert command("merge", *maps, "--trust-priors", "--elastic", "--out", out) == 0
    save_map(load_map(maps[0]).grid, tmp_path / "c")
    assert command("merge", out, "--add", tmp_path / "c.yaml", "--trust-priors") == 0
    assert record(out)["elastic"] is True
    assert "b" in [entry["name"] for entry in record(out)["groups"][0]["bends"]]


def test_the_table_names_the_largest_bend(maps: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert command("merge", *maps, "--trust-priors", "--elastic") == 0
    shown = capsys.readouterr().out
    assert "b: bent by up to 0." in shown
    assert "without bends" in shown


def test_crisp_maps_are_said_to_stay(maps: tuple[Path, Path], tmp_path: Path, capsys) -> None:
    save_map(load_map(maps[0]).grid, tmp_path / "same")
    both = maps[0], tmp_path / "same.yaml"
    assert command("merge", *both, "--trust-priors", "--elastic", "--out", tmp_path / "elastic") == 0
    assert "a, same: not bent, because bending brings no walls together" in " ".join(capsys.readouterr().out.split())
    assert command("merge", *both, "--trust-priors", "--out", tmp_path / "rigid") == 0
    one, other = hashes(tmp_path / "elastic"), hashes(tmp_path / "rigid")
    assert one.keys() == other.keys()
    assert {name for name in one if one[name] != other[name]} <= {"merge.json", ".mapquilt-files.json"}


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("multimap.elastic.min_gain=2", "min_gain is 2"),
        ("multimap.elastic.straightening.stiffness=-1", "stiffness is -1"),
        ("multimap.elastic.straightening.min_parallel_share=-0.1", "min_parallel_share is -0.1"),
    ],
)
def test_settings_out_of_range_are_refused(maps: tuple[Path, Path], capsys, setting: str, said: str) -> None:
    assert said in refused(capsys, "merge", *maps, "--elastic", "--set", setting)
