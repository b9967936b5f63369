"""The commands and the picture of docs/particle.md work."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from mapping.particle.settings import ParticleSettings
from mapping.particle.tiles import TILE
from tests.conftest import command

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "particle.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line) for line in re.findall(r"^    mapquilt (.*)$", PAGE, re.MULTILINE)]


def test_every_command_and_the_picture_of_the_page_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for words in COMMANDS:
        assert command(*words, *(("--duration", 4) if words[0] == "simulate" else ())) == 0, words
    script = [sys.executable, str(DOCS / "particle_example.py"), "runs/particle-2", "seen.png"]
    subprocess.run(script, check=True, env={"PYTHONPATH": str(DOCS.parent)})
    assert Path("seen.png").read_bytes().startswith(b"\x89PNG")


def test_its_numbers_are_the_defaults() -> None:
    defaults = ParticleSettings()
    assert f"After {defaults.update_distance:g} m or {defaults.update_angle:g} rad of motion" in PAGE
    assert f"tiles of {TILE} x {TILE} cells" in PAGE
    assert defaults.resample_below == 0.5 and "below half of the particles" in PAGE
