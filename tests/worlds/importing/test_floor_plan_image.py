"""Free cells of floor plans: dark and unknown are solid, transparent is free."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from mapping.io.map_file import save_map
from worlds.importing.floor_plan_image import read_plan_map, read_plan_picture


def test_in_a_picture_dark_is_wall_and_transparent_is_not(tmp_path: Path) -> None:
    grey = np.full((10, 20), 250, np.uint8)
    grey[[0, -1]] = grey[:, [0, -1]] = 10
    grey[1, 5] = 100  # near the top of the picture, so high in the world
    alpha = np.full_like(grey, 255)
    grey[5, 5], alpha[5, 5] = 0, 0
    Image.fromarray(np.stack((grey, alpha), axis=-1), "LA").save(tmp_path / "plan.png")
    plan = read_plan_picture(tmp_path / "plan.png", 0.1)
    assert np.argwhere(~plan.free[1:-1, 1:-1]).tolist() == [[7, 4]]


@pytest.mark.parametrize("ending", ["jpg", "bmp", "tif", "png"])
def test_pictures_of_any_kind_are_plans(tmp_path: Path, ending: str) -> None:
    grey = np.full((40, 60), 255, np.uint8)
    grey[:, :8] = grey[:16] = 0
    Image.fromarray(grey).save(tmp_path / f"plan.{ending}", quality=95)
    assert np.array_equal(read_plan_picture(tmp_path / f"plan.{ending}", 0.1).free, grey[::-1] > 0)


def test_unknown_is_solid_in_a_picture_with_the_greys_of_a_map_saver(tmp_path: Path) -> None:
    grey = np.full((10, 20), 205, np.uint8)
    grey[2:8, 2:18], grey[5, 5] = 254, 0
    Image.fromarray(grey).save(tmp_path / "map.png")
    plan = read_plan_picture(tmp_path / "map.png", 0.1)
    assert np.array_equal(plan.free, grey[::-1] == 254)
    assert "205" in plan.notes[0]
    Image.fromarray(np.where(grey == 0, 7, grey).astype(np.uint8)).save(tmp_path / "picture.png")
    plan = read_plan_picture(tmp_path / "picture.png", 0.1)
    assert np.array_equal(plan.free, grey[::-1] > 0)
    assert plan.notes == ()


def test_in_a_map_unknown_is_solid(tmp_path: Path) -> None:
    cells = np.full((30, 40), UNKNOWN)
    cells[5:25, 5:35] = OCCUPIED
    cells[6:24, 6:34] = FREE
    cells[10, 10] = UNKNOWN
    save_map(OccupancyGrid.from_occupancy(GridFrame(0.1, SE2(-3.0, 2.0, 0.0), (30, 40)), cells), tmp_path / "map")
    plan = read_plan_map(tmp_path / "map.yaml")
    assert np.array_equal(plan.free, cells == FREE)
    assert (plan.resolution, plan.notes) == (0.1, ())


@pytest.mark.parametrize("resolution", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_resolutions_are_refused(resolution: float) -> None:
    with pytest.raises(ValueError, match="resolution is"):
        read_plan_picture(Path("plan.png"), resolution)
