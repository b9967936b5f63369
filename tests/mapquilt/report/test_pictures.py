"""Pictures of pairs: nothing is flipped, and each map is at its transform."""

from __future__ import annotations

import base64
import io
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import save_map
from mapquilt.evaluation.evaluated_pair import EvaluatedPair, GroundTruth, PairInfo
from mapquilt.report.pictures import Painter
from mapquilt.viz.palette import ROBOTS, WALL

BLUE, ORANGE = (tuple(bytes.fromhex(colour[1:])) for colour in ROBOTS[:2])


def l_shape(turn: float = 0.0) -> OccupancyGrid:
    """Free floor of 4 x 2 m with a block at its lower left, and one above that: an L that no mirror leaves alone."""
    cells = np.full((40, 80), -1.0, np.float32)
    cells[:10, :40] = 1.0
    cells[10:20, :10] = 1.0
    return OccupancyGrid(GridFrame(0.05, SE2(0.0, 0.0, turn), cells.shape), cells)


@pytest.fixture
def pair(tmp_path: Path) -> EvaluatedPair:
    for name in ("a", "b"):
        save_map(l_shape(), tmp_path / name)
    info = PairInfo("p", "a", "b", target_file=tmp_path / "a.yaml", source_file=tmp_path / "b.yaml")
    return EvaluatedPair(info, GroundTruth(Similarity2()), answer=Similarity2())


def pixels(address: str) -> np.ndarray:
    image = Image.open(io.BytesIO(base64.b64decode(address.partition(",")[2])))
    return np.asarray(image.convert("RGBA"))


def mask(image: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    return (image[..., :3] == colour).all(axis=-1) & (image[..., 3] == 255)


def test_a_map_is_upright(pair):
    walls = mask(pixels(Painter().draw(pair).target), BLUE)
    rows, cols = np.nonzero(walls)
    height, width = walls.shape
    assert height < width
    assert rows.mean() > height / 2 and cols.mean() < width / 2
    assert walls[: height // 2].sum() < 0.05 * walls.sum()


def test_maps_that_coincide_share_their_walls(pair):
    image = pixels(Painter().draw(pair).by_truth)
    assert mask(image, WALL).sum() > 0.9 * (image[..., 3] == 255).sum() * (500 / 3200)
    assert mask(image, ORANGE).sum() < 0.02 * mask(image, WALL).sum()


def test_the_source_lies_where_the_answer_puts_it(pair):
    moved = Painter().draw(replace(pair, answer=Similarity2(0.0, 2.5, math.pi / 2, 0.5))).by_answer
    image = pixels(moved)
    target, source = (np.argwhere(mask(image, colour)).mean(axis=0) for colour in (BLUE, ORANGE))
    assert source[0] < target[0]  # y is up
    rows, cols = np.nonzero(mask(image, ORANGE))
    assert np.ptp(rows) > 1.5 * np.ptp(cols)  # lying blocks stand when turned by a quarter


def test_answer_and_truth_are_drawn_on_one_canvas(pair):
    drawn = Painter().draw(replace(pair, answer=Similarity2(1.0, 3.0, 0.3, 1.2)))
    assert pixels(drawn.by_answer).shape == pixels(drawn.by_truth).shape
    assert mask(pixels(drawn.by_answer), ORANGE).any()


def test_a_far_answer_does_not_shrink_the_maps_too_much(pair):
    image = pixels(Painter().draw(replace(pair, answer=Similarity2(1e6, 0.0, 0.0, 1.0))).by_answer)
    assert mask(image, BLUE).sum() > 200
    assert max(image.shape) <= 500


def test_unknown_is_transparent_and_a_missing_answer_is_not_drawn(pair):
    drawn = Painter().draw(replace(pair, answer=None, truth=GroundTruth(None)))
    assert drawn.by_answer is drawn.by_truth is drawn.by_alternative is None
    assert (pixels(drawn.target)[0, :, 3] == 0).all()
