"""A short run whose robots see the same rooms, and processes on the loopback interface."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.conftest import command

if TYPE_CHECKING:
    from mapquilt.live.ros2.network import Network
    from tests.mapquilt.live.processes import Processes


@pytest.fixture(scope="session")
def close_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two robots that see the same rooms."""
    run = tmp_path_factory.mktemp("runs") / "close"
    size = ("--robots", 2, "--duration", 20, "--seed", 3, "--starts", "close")
    assert command("simulate", "office", *size, "--noise", 0, "--poses", "odometry", "--out", run) == 0
    return run


@pytest.fixture(scope="session")
def network() -> Iterator[Network]:
    """The loopback interface, as the processes of this worker see it; a process can join a domain but once."""
    pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")
    from mapquilt.live.ros2.network import Network
    from tests.mapquilt.live.processes import DOMAIN, LOOPBACK

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        yield Network(DOMAIN)


@pytest.fixture
def processes() -> Iterator[Processes]:
    """Start processes, which are killed at the end of a test."""
    pytest.importorskip("cyclonedds", reason="needs the extra [live]: pip install mapquilt[live]")
    from tests.mapquilt.live.processes import Processes

    started = Processes()
    yield started
    started.kill()
