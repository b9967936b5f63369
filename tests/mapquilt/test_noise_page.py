"""docs/noise.md states every component and every preset as the code has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from mapquilt.lidar_table import lidar_row
from sim.lidar_presets import PRESETS, LidarPreset
from sim.noise import COMPONENTS, Noise

PAGE = (Path(__file__).parents[2] / "docs/noise.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("preset", PRESETS, ids=lambda preset: preset.name)
def test_each_preset_has_its_numbers_and_sources(preset: LidarPreset) -> None:
    name, *numbers = lidar_row(preset)
    assert f"| `{name}` | {' | '.join(numbers)} |" in PAGE
    told = " ".join(PAGE.split())
    assert f"- `{name}`: {'; '.join(preset.sources)}." in told


@pytest.mark.parametrize("component", COMPONENTS)
def test_each_component_is_told_of_with_its_level(component: str) -> None:
    row = next(line for line in PAGE.splitlines() if line.startswith("|") and f"`{component}`" in line)
    names, *_, levels = [cell.strip() for cell in row.strip("|").split("|")]
    if component.startswith("odometry."):
        told = dict(zip(names.replace("`", "").split(", "), levels.split(", "), strict=True))
        assert float(told[component]) == getattr(Noise().odometry, component.partition(".")[2])
