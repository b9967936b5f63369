"""Text in drawn plans: letters go, pillars and furniture stay."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from worlds.importing.plan_file import PlanOptions, read_plan
from worlds.importing.text import find_text, without_text

RESOLUTION = 0.02


def plan() -> np.ndarray:
    """A room of 20 x 16 m with walls, a row of pillars, a row of boxes and a row of hollow ones."""
    grey = np.full((800, 1000), 255, np.uint8)
    cv2.rectangle(grey, (50, 50), (950, 750), 0, 8)
    cv2.line(grey, (500, 50), (500, 400), 0, 8)
    for x in range(150, 450, 60):
        cv2.circle(grey, (x, 450), 12, 0, -1)
    for x in range(550, 900, 20):
        cv2.rectangle(grey, (x, 320), (x + 12, 332), 0, -1)
    for x in range(550, 900, 40):
        cv2.rectangle(grey, (x, 680), (x + 16, 696), 0, 2)
    return grey


def written(text: str, at: tuple[int, int], size: float) -> np.ndarray:
    grey = plan()
    cv2.putText(grey, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, 0, 2)
    return grey


@pytest.mark.parametrize(
    ("text", "at", "size", "letters"),
    [
        ("Kitchen", (100, 200), 1.0, 7),
        ("BATH", (600, 200), 1.2, 4),
        ("WC", (700, 500), 1.0, 2),
        ("A 23", (100, 600), 0.7, 3),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_the_letters_go_and_everything_else_stays(text, at, size, letters, turned) -> None:
    before, grey = plan() > 128, written(text, at, size) > 128
    if turned:
        before, grey = np.rot90(before), np.rot90(grey)
    kept, notes = without_text(grey, RESOLUTION)
    left = before & ~kept
    assert left.sum() <= 40  # the dot of an i, which is dropped as a speck
    assert not (kept & ~before).any()
    assert notes == (f"dropped {letters} letters of text",)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_solid_boxes_are_never_letters(seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = np.ones((128, 160), dtype=bool)
    for slot in np.ndindex(8, 10):
        height, width = rng.integers(0, 15, 2)
        row, col = 16 * np.array(slot)
        free[row : row + height, col : col + width] = False
    assert not find_text(free, 0.05)[1].size


def test_a_plan_with_text_says_so_and_from_map_drops_it(tmp_path: Path) -> None:
    path = tmp_path / "plan.png"
    cv2.imwrite(str(path), written("Kitchen", (100, 200), 1.0))
    world, notes = read_plan(path, None, PlanOptions(resolution=RESOLUTION))
    assert notes == (f"{path}: has 7 solids that look like letters of text; --from-map drops them",)
    mended, notes = read_plan(path, None, PlanOptions(resolution=RESOLUTION, mended=True))
    assert f"{path}: dropped 7 letters of text" in notes
    assert len(mended.obstacles) < len(world.obstacles)


def test_a_map_of_a_robot_has_no_text(tmp_path: Path) -> None:
    grey = written("Kitchen", (100, 200), 1.0)
    grey[:, :300][grey[:, :300] > 128] = 205
    cv2.imwrite(str(tmp_path / "map.png"), grey)
    _, notes = read_plan(tmp_path / "map.png", None, PlanOptions(resolution=RESOLUTION))
    assert not any("text" in note for note in notes)
