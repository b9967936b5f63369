"""Maps on another raster: every wall stays at its metres, and impossible rasters are refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import load_map, save_map
from mapquilt.convert.reframing import Reframing
from tests.conftest import command
from tests.mapquilt.cli.test_app import office_map
from tests.mapquilt.convert.test_command import refused


def turned_office(yaw: float) -> OccupancyGrid:
    grid = office_map()
    return OccupancyGrid(GridFrame(0.05, SE2(-1.0, 2.0, yaw), grid.frame.shape), grid.log_odds)


def walls(grid: OccupancyGrid) -> np.ndarray:
    return grid.frame.metres_from_cells(np.argwhere(grid.occupied))


def same_places(one: OccupancyGrid, other: OccupancyGrid, within: float) -> bool:
    """Check that each wall of either map lies near one of the other."""
    from scipy.spatial import cKDTree

    pairs = ((walls(one), walls(other)), (walls(other), walls(one)))
    return all(cKDTree(there).query(here)[0].max() <= within for here, there in pairs)


@pytest.mark.parametrize("yaw", [0.3, -2.5])
def test_the_yaw_of_the_origin_is_baked_in(yaw: float, tmp_path: Path) -> None:
    before = turned_office(yaw)
    save_map(before, tmp_path / "a")
    assert command("convert", tmp_path / "a.yaml", tmp_path / "b.yaml", "--yaw", 0) == 0
    after = load_map(tmp_path / "b.yaml").grid
    assert after.frame.origin.yaw == 0.0
    assert same_places(before, after, 0.05 * math.sqrt(2.0))


@pytest.mark.parametrize("yaw", [0.0, 0.3, -1.1])
def test_walls_are_aligned_with_the_picture(yaw: float) -> None:
    """A map whose walls run askew in its picture: the turn is found to within a fifth of a degree."""
    askew = Reframing(yaw=0.0).apply(turned_office(yaw))
    after = Reframing(align_walls=True).apply(askew)
    assert abs(math.remainder(after.frame.origin.yaw - yaw, math.pi / 2.0)) < math.radians(0.2)
    assert same_places(askew, after, 0.05 * math.sqrt(2.0))


def test_degrees_are_radians(tmp_path: Path) -> None:
    save_map(turned_office(0.2), tmp_path / "a")
    assert command("convert", tmp_path / "a.yaml", tmp_path / "b.yaml", "--yaw=-90deg") == 0
    assert load_map(tmp_path / "b.yaml").grid.frame.origin.yaw == pytest.approx(-math.pi / 2.0)


@pytest.mark.parametrize("resolution", [0.025, 0.1])
def test_another_resolution_keeps_all_walls(resolution: float) -> None:
    before = turned_office(0.4)
    after = Reframing(resolution=resolution).apply(before)
    assert after.frame.resolution == resolution
    assert after.frame.origin.yaw == before.frame.origin.yaw
    assert same_places(before, after, max(0.05, resolution) * math.sqrt(2.0))


def test_a_crop_changes_no_cell() -> None:
    before = turned_office(0.4)
    after = Reframing(crop=True).apply(before)
    assert after.frame.shape < before.frame.shape
    np.testing.assert_allclose(walls(after), walls(before), atol=1e-9)
    assert np.count_nonzero(after.known) == np.count_nonzero(before.known)


def test_no_change_is_the_same_map() -> None:
    before = turned_office(0.4)
    assert Reframing().apply(before) is before


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--yaw", "north"), "--yaw north: must be an angle [rad], or one in degrees such as 90deg"),
        (("--yaw", "0", "--align-walls"), "--align-walls: chooses the yaw itself"),
        (("--resolution", "0"), "--resolution 0: must be positive"),
        (("--resolution", "1e-5"), "more than the 134217728 that a map may have"),
    ],
)
def test_an_impossible_raster_is_refused(
    options: tuple[str, ...], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_map(turned_office(0.0), tmp_path / "a")
    assert expected in refused(capsys, tmp_path / "a.yaml", tmp_path / "b.yaml", *options)
    assert not (tmp_path / "b.yaml").exists()


def test_a_map_without_a_main_direction_is_refused() -> None:
    cells = np.where(np.random.default_rng(0).random((200, 200)) < 0.05, 100, 0)
    grid = OccupancyGrid.from_occupancy(GridFrame(0.05, SE2(), cells.shape), cells)
    with pytest.raises(ValueError, match="no main direction"):
        Reframing(align_walls=True).apply(grid)


def test_a_picture_without_a_resolution_gets_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_map(turned_office(0.0), tmp_path / "a")
    (tmp_path / "a.yaml").unlink()
    expected = "a.pgm: a picture without YAML has neither resolution nor yaw to change"
    assert expected in refused(capsys, tmp_path / "a.pgm", tmp_path / "b.pgm", "--resolution", "0.1")
