"""docs/noise.md describes every component and every preset of the code."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from mapquilt.cli.verbs.lidars import lidar_row
from sim.sensors.adversity.settings import AMOUNTS, LEVEL_ONE, Adversity
from sim.sensors.lidar_presets import PRESETS, LidarPreset
from sim.sensors.noise import COMPONENTS, Noise

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "noise.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)
def test_each_preset_has_its_numbers_and_sources(preset: LidarPreset) -> None:
    name, *numbers = lidar_row(preset)
    assert f"| `{name}` | {' | '.join(numbers)} |" in PAGE
    documented = " ".join(PAGE.split())
    assert f"- `{name}`: {'; '.join(preset.sources)}." in documented


@pytest.mark.parametrize("component", COMPONENTS)
def test_each_component_is_documented_with_its_level(component: str) -> None:
    row = next(line for line in PAGE.splitlines() if line.startswith("|") and f"`{component}`" in line)
    names, *_, levels = [cell.strip() for cell in row.strip("|").split("|")]
    if component.startswith("odometry."):
        documented = dict(zip(names.replace("`", "").split(", "), levels.split(", "), strict=True))
        assert float(documented[component]) == getattr(Noise().odometry, component.partition(".")[2])


@pytest.mark.parametrize("component", [name for name in COMPONENTS if name.startswith("adversity.")])
def test_each_adversity_is_documented_with_its_default_and_level_one(component: str) -> None:
    row = next(line for line in PAGE.splitlines() if line.startswith("|") and f"`{component}`" in line)
    names, _, *values = [cell.strip().split(", ") for cell in row.strip("|").split("|")]
    place, field = names.index(f"`{component}`"), component.partition(".")[2]
    documented = [float(each[place]) for each in values]
    assert documented == pytest.approx([getattr(Adversity(), field), getattr(LEVEL_ONE, field)], rel=1e-3)


def script(name: str, *arguments: Path) -> str:
    command = [sys.executable, str(DOCS / name), *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True, cwd=DOCS.parent).stdout


def test_the_drift_is_measured_on_any_run(merged_run: Path) -> None:
    first, *levels = script("noise_drift.py", merged_run).splitlines()
    assert re.fullmatch(r"2 paths of \d+ to \d+ m, 30 drifts each", first)
    yaws = [float(re.findall(r"([\d.]+) degrees", line)[0]) for line in levels]
    assert [line.partition(":")[0] for line in levels] == ["alphas alone", "wheels alone", "level 1", "level 3"]
    assert 0.0 < max(yaws[:2]) < yaws[2] < yaws[3]


def test_the_picture_is_drawn_of_any_run(merged_run: Path, tmp_path: Path) -> None:
    script("noise_example.py", merged_run, tmp_path / "noise.png")
    assert (tmp_path / "noise.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_picture_of_adversity_is_drawn_of_any_run(merged_run: Path, tmp_path: Path) -> None:
    script("adversity_example.py", merged_run, tmp_path / "adversity.png")
    assert (tmp_path / "adversity.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_effect_of_adversity_is_measured_on_any_run(merged_run: Path) -> None:
    head, _, *rows, last = script("adversity_effect.py", merged_run).splitlines()
    assert head in PAGE.splitlines()
    cells = {row.split(" | ")[0].strip("| "): [float(number) for number in re.findall(r"[\d.]+", row)] for row in rows}
    assert list(cells) == ["none", *AMOUNTS, "all"]
    assert cells["none"][0] < cells["glass"][0] < cells["all"][0]
    assert cells["none"][1] > cells["all"][1]
    assert cells["none"][-1] < cells["latency"][-1]
    assert last == "2 robots"
