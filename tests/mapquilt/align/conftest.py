"""Two maps of one building with their true transform, as files and as a workspace, and its server."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import pytest

from mapping.geometry.similarity2 import Similarity2
from mapping.io.map_file import save_map
from mapquilt.align.open_task import open_task
from mapquilt.align.server import AlignServer
from mapquilt.align.workspace import Workspace
from tests.mapquilt.report.conftest import browser
from tests.merge.test_merger import team

__all__ = ["browser"]


@dataclass(frozen=True)
class Two:
    """Files of two maps, and the true transform from the second to the first."""

    files: tuple[Path, Path]
    target_from_source: Similarity2


@pytest.fixture(scope="session")
def two(tmp_path_factory: pytest.TempPathFactory) -> Two:
    maps, frames = team(8, 2)
    folder = tmp_path_factory.mktemp("two")
    for name, grid in zip(maps.names, maps.grids, strict=True):
        save_map(grid, folder / name)
    return Two((folder / "a.yaml", folder / "b.yaml"), frames[0] @ frames[1].inverse())


@pytest.fixture
def workspace(two: Two, tmp_path: Path) -> Workspace:
    return Workspace(open_task(two.files, tmp_path / "out", None, None, 0))


def sheet_pose(workspace: Workspace, target_from_source: Similarity2) -> Similarity2:
    """The pose on the sheet at which the second map lies so on the first one."""
    return workspace.arrangement.placements[0].sheet_from_map @ target_from_source


@dataclass(frozen=True)
class Client:
    """A client of the server that sends what a test says, and nothing else."""

    server: AlignServer

    def ask(
        self, method: str, path: str, body: bytes | None = None, headers: dict[str, str] | None = None
    ) -> tuple[int, dict[str, str], bytes]:
        """Send a request; return status, headers and body."""
        connection = HTTPConnection("127.0.0.1", self.server.port, timeout=120)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        given = {"Host": f"127.0.0.1:{self.server.port}", "Content-Type": "application/json", **(headers or {})}
        if body is not None:
            given["Content-Length"] = str(len(body))
        for name, value in given.items():
            connection.putheader(name, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
        connection.close()
        return found

    def call(self, name: str, **body: Any) -> tuple[int, dict[str, Any]]:
        """Call the server as the page does; return the status and the record."""
        status, _, content = self.ask("POST", f"/{self.server.token}/{name}", json.dumps(body).encode())
        return status, json.loads(content)


@pytest.fixture
def client(workspace: Workspace) -> Iterator[Client]:
    server = AlignServer(workspace)
    thread = threading.Thread(target=server.run)
    thread.start()
    yield Client(server)
    server.stop()
    thread.join(60)
    assert not thread.is_alive()
