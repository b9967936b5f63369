"""A few pairs of map files whose pixel transforms are known exactly."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from mapping.grid.occupancy_grid import OccupancyGrid
from tests.merge.literature.crisp import crisp_pair

GREYS = ((0, "occupied"), (254, "free"))


def picture_of(grid: OccupancyGrid) -> np.ndarray:
    """The map as map_server's greys, highest row first."""
    picture = np.full(grid.frame.shape, 205, np.uint8)
    for grey, part in GREYS:
        picture[getattr(grid, part)] = grey
    return picture[::-1]


@pytest.fixture(scope="session")
def pairs_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """pairs.json with two true pairs, one of them at scale 1.3, and one of two buildings; not to be written to."""
    folder = tmp_path_factory.mktemp("suite")
    entries: list[dict[str, Any]] = []
    for number, scale in enumerate((1.0, 1.3)):
        target, source, truth = crisp_pair(scale)
        names = [f"{number}{side}.png" for side in "ab"]
        for name, prepared in zip(names, (target, source), strict=True):
            cv2.imwrite(str(folder / name), picture_of(prepared.grid))
        heights = [prepared.grid.frame.shape[0] for prepared in (target, source)]
        entries.append(
            {"name": f"pair{number}", "kind": "cut", "subset": f"part{number}", "map_a": names[0], "map_b": names[1]}
            | {"overlap": 0.6 - 0.4 * number, **in_pixels(truth, *heights)}
        )
    other = crisp_pair(1.0, 8)[1]
    cv2.imwrite(str(folder / "other.png"), picture_of(other.grid))
    entries.append({"name": "none", "kind": "negative", "map_a": "0a.png", "map_b": "other.png", "scale": None})
    path = folder / "pairs.json"
    path.write_text(json.dumps({"pairs": entries}))
    return path


def in_pixels(truth: Any, target_rows: int, source_rows: int) -> dict[str, float]:
    """A transform of cells, y up, as one of pixels, y down, centres at integers; worked out by hand.

    A pixel is u = x - 1/2, v = rows - 1/2 - y of its cell point.
    """
    angle, size = -truth.yaw, truth.scale
    origin = truth.apply(np.array([[0.5, source_rows - 0.5]]))[0]  # where pixel (0, 0) of the source comes to lie
    return {
        "scale": size,
        "rotation_deg": math.degrees(angle),
        "tx": float(origin[0] - 0.5),
        "ty": float(target_rows - 0.5 - origin[1]),
    }
