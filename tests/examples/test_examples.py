"""Every example runs and writes its picture."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.se2 import SE2
from mapping.geometry.similarity2 import Similarity2
from mapping.grid.frame import GridFrame
from mapping.grid.pixel_matrix import pixel_matrix
from tests.conftest import command

ROOT = Path(__file__).parents[2]


def run(folder: Path, name: str, *arguments: object) -> str:
    """Run an example in a folder, and return what it prints."""
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), *map(str, arguments)]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


@pytest.mark.slow
def test_two_maps_are_merged(merged_run: Path, tmp_path: Path) -> None:
    maps = [merged_run / f"robot_{index}/map.yaml" for index in range(2)]
    assert "transform of" in run(tmp_path, "merge_two_maps", *maps, tmp_path / "merged")
    assert (tmp_path / "merged/merge.png").is_file()


@pytest.mark.slow
def test_a_team_is_merged_and_evaluated(tmp_path: Path) -> None:
    printed = run(tmp_path, "merge_a_team", "team")
    assert printed.count("overlap") == 6
    assert (tmp_path / "team/merge.png").is_file()


@pytest.mark.slow
def test_a_data_set_is_made_and_a_method_of_ones_own_is_benchmarked(tmp_path: Path) -> None:
    assert "overlap" in run(tmp_path, "make_a_dataset", "pairs")
    assert (tmp_path / "pairs/samples/000000/preview.png").is_file()
    run(tmp_path, "benchmark_your_own_method", "pairs", "bench")
    assert "principal_axes" in (tmp_path / "bench/table.md").read_text(encoding="utf-8")
    assert list((tmp_path / "bench/sheets").glob("principal_axes-*.png"))
    assert command("benchmark", "export", tmp_path / "pairs", "--out", tmp_path / "export") == 0
    options = []
    for name in ("answers_opencv", "answers_m_explore"):
        run(tmp_path, name, "export", f"{name}.csv")
        options += ["--answers", tmp_path / f"{name}.csv"]
    assert command("benchmark", "--dataset", tmp_path / "pairs", *options, "--out", tmp_path / "answered") == 0
    assert list((tmp_path / "answered/sheets").glob("answers_m_explore-from-answers-*.png"))


@pytest.mark.slow
def test_a_study_of_noise_is_drawn(tmp_path: Path) -> None:
    run(tmp_path, "noise_study", "study")
    assert (tmp_path / "study/success.png").is_file()


def test_every_example_has_a_docstring_with_its_call() -> None:
    """The docstring of each example describes it and shows the call."""
    for file in (ROOT / "examples").glob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert f"python examples/{file.name}" in text.split('"""')[1]


def test_a_pose_of_mrpt_becomes_the_matrix_of_pixels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    example = importlib.import_module("answers_mrpt")
    frames = [GridFrame(example.CELL, SE2(), (rows, 80)) for rows in (120, 75)]
    expected = pixel_matrix(frames[0], Similarity2(3.0, -2.0, 0.7), frames[1])
    np.testing.assert_allclose(example.pixel_matrix(3.0, -2.0, 0.7, 120, 75), expected, atol=1e-9)
