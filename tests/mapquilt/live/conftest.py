"""A short run whose robots see the same rooms."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import command


@pytest.fixture(scope="session")
def close_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two robots that see the same rooms."""
    run = tmp_path_factory.mktemp("runs") / "close"
    size = ("--robots", 2, "--duration", 20, "--seed", 3, "--starts", "close")
    assert command("simulate", "office", *size, "--noise", 0, "--poses", "odometry", "--out", run) == 0
    return run
