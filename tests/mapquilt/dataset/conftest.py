"""A tiny data set, made once per worker."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import command

SPEC = """\
name: tiny
seed: 5
missions:
  - {world: office, count: 3, robots: 2, duration: 1}
samples:
  per_mission: 2
  noise: [0, 1]
other_worlds: 2
splits: {train: 0.67, test: 0.33}
"""


@pytest.fixture(scope="session")
def spec_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("spec") / "tiny.yaml"
    path.write_text(SPEC)
    return path


@pytest.fixture(scope="session")
def tiny(spec_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The data set of the specification; not to be written to."""
    folder = tmp_path_factory.mktemp("data") / "tiny"
    assert command("dataset", "make", spec_file, "--out", folder, "--workers", 1) == 0
    return folder
