"""The site builds without a warning, and its reference holds every verb."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mapquilt.cli.app import VERBS

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_site_builds_and_documents_every_verb(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, env=quiet, capture_output=True, text=True)
    assert (built.returncode, built.stderr) == (0, "")
    page = (tmp_path / "reference/cli/index.html").read_text(encoding="utf-8")
    for verb in VERBS:
        assert f"mapquilt {verb}" in page


def test_every_path_that_the_architecture_page_names_exists() -> None:
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    named = [word for word in text.split("`")[1::2] if "/" in word and " " not in word]
    assert len(named) > 20
    assert [path for path in named if not (ROOT / path).exists()] == []
