"""The server: refusals of wrong addresses, hosts, pages and bodies; the calls of the page."""

from __future__ import annotations

import json
import sys
import threading
from pathlib import Path

import pytest

from mapquilt.align.server import MOST_BYTES, PAGE_FILES, AlignServer
from tests.conftest import command


def test_every_file_of_the_page_is_served_and_nothing_else_is_there(client) -> None:
    folder = Path(sys.modules["mapquilt.align.server"].__file__).parent / "page"
    of_reports = {"embedded.js"}
    assert {path.name for path in folder.iterdir()} - of_reports == {name or "index.html" for name in PAGE_FILES}
    for name, kind in PAGE_FILES.items():
        status, headers, body = client.ask("GET", f"/{client.server.token}/{name}")
        assert (status, headers["content-type"].partition(";")[0]) == (200, kind)
        assert body == (folder / (name or "index.html")).read_bytes()
        assert headers["content-security-policy"].startswith("default-src 'self'")


@pytest.mark.parametrize("path", ["/", "//", "/wrong/", "/wrong/start", "/{token}x/start", "/{short}/start"])
def test_a_wrong_token_is_refused(client, path) -> None:
    token = client.server.token
    status, _, body = client.ask("GET", path.format(token=token, short=token[:-1]))
    assert (status, b"token" in body) == (404, True)


def test_no_path_reaches_the_file_system(client) -> None:
    start = f"/{client.server.token}"
    for path in (
        "/../server.py",
        "/..%2fserver.py",
        "/%2e%2e/server.py",
        "//etc/passwd",
        "/page/main.js",
        "/maps/../../etc/passwd",
        "/maps/-1/cells",
        "/maps/99/cells",
        "/maps/a.yaml/cells",
        "/__init__.py",
    ):
        status, _, body = client.ask("GET", start + path)
        assert status == 404, path
        assert b"root:" not in body and b"import" not in body


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "evil.example:{port}", "0.0.0.0:{port}"])
def test_another_host_is_refused(client, host) -> None:
    """A name of an attacker that leads to the loopback (DNS rebinding) is not this host."""
    host = host.format(port=client.server.port)
    status, _, _ = client.ask("GET", f"/{client.server.token}/start", headers={"Host": host})
    assert status == 421


def test_another_page_is_refused(client) -> None:
    path, body = f"/{client.server.token}/undo", b"{}"
    assert client.ask("POST", path, body, {"Origin": "http://evil.example"})[0] == 403
    assert client.ask("POST", path, body, {"Origin": "null"})[0] == 403
    assert client.ask("POST", path, body, {"Content-Type": "text/plain"})[0] == 415
    assert client.ask("POST", path, body, {"Origin": f"http://127.0.0.1:{client.server.port}"})[0] == 200


@pytest.mark.parametrize(
    ("name", "body", "says"),
    [
        ("place", b"", "JSON"),
        ("place", b"{}", "map: Field required"),
        ("place", b'{"map": 1, "x": NaN, "y": 0, "yaw": 0, "scale": 1}', "x"),
        ("place", b'{"map": 1, "x": 1e300, "y": 0, "yaw": 0, "scale": 1}', "x: Input should be less"),
        ("place", b'{"map": 1, "x": 0, "y": 0, "yaw": 0, "scale": 0}', "scale"),
        ("place", b'{"map": 7, "x": 0, "y": 0, "yaw": 0, "scale": 1}', "map is 7, must be 0 to 1"),
        ("snap", b'{"map": 1, "others": []}', "no other visible map"),
        ("snap", b'{"map": 1, "others": [1]}', "cannot be compared with itself"),
        ("snap", b'{"map": 1, "others": [-1]}', "map is -1, must be 0 to 1"),
        ("candidates", b'{"map": 1, "other": 1}', "cannot be compared with itself"),
        ("save", b'{"out": "/tmp/elsewhere"}', "out: Extra inputs are not permitted"),
        ("save", b'{"frame_of": 2}', "map is 2, must be 0 to 1"),
        ("save", b'{"as_placed": true}', "b: has not been placed"),
    ],
)
def test_a_bad_body_is_told_and_changes_nothing(client, workspace, name, body, says) -> None:
    before = workspace.history
    status, _, content = client.ask("POST", f"/{client.server.token}/{name}", body)
    assert status == 400
    assert says in json.loads(content)["error"]
    assert workspace.history is before


def test_a_long_body_is_refused(client) -> None:
    assert client.ask("POST", f"/{client.server.token}/undo", b" " * (MOST_BYTES + 1))[0] == 413


def test_the_calls_of_the_page(client, workspace, two) -> None:
    status, _, body = client.ask("GET", f"/{client.server.token}/start")
    record = json.loads(body)
    assert (status, [each["name"] for each in record["maps"]]) == (200, ["a", "b"])
    first = record["maps"][0]
    _, _, cells = client.ask("GET", f"/{client.server.token}/maps/0/cells")
    assert (len(cells), set(cells)) == (first["rows"] * first["cols"], {0, 1, 2})
    _, placed = client.call("place", map=1, x=1.0, y=2.0, yaw=0.5, scale=1.0)
    assert placed["state"]["placements"][1] == {"x": 1.0, "y": 2.0, "yaw": 0.5, "scale": 1.0, "decided_by": "hand"}
    _, undone = client.call("undo")
    assert undone["state"]["placements"] == record["state"]["placements"]
    assert client.call("redo")[1]["state"] == placed["state"]
    _, measured = client.call("measure", map=1, x=1.0, y=2.0, yaw=0.5, scale=1.0, others=[0])
    assert [pair["other"] for pair in measured["pairs"]] == [0]
    assert set(measured["walls"]) == {"0", "1"}
    _, found = client.call("candidates", map=1, other=0)
    assert found["answer"]["accepted"]
    _, chosen = client.call("choose", map=1, other=0, number=0)
    assert chosen["state"]["placements"][1]["decided_by"] == "choice"
    assert client.call("reference", map=1)[1]["state"]["reference"] == 1
    _, saved = client.call("save")
    assert {"align.json", "merge.json", "merged.pgm"} <= set(saved["files"])
    assert saved["state"]["solved"]["left_out"] == []


def test_a_taken_port_is_told(client, workspace) -> None:
    with pytest.raises(ValueError, match=rf"--port {client.server.port}: .*choose another"):
        AlignServer(workspace, client.server.port)


def test_without_the_extra_the_verb_names_it(two, capsys, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.delitem(sys.modules, "mapquilt.align.server")
    assert command("align", *two.files, "--no-browser") == 2
    says = "mapquilt: mapquilt align needs the packages starlette and uvicorn: pip install 'mapquilt[align]'\n"
    assert capsys.readouterr().err == says


def test_the_end_of_the_server_waits_for_the_request_that_runs(client, workspace, monkeypatch) -> None:
    solve, started, go = workspace.solve, threading.Event(), threading.Event()

    def slow():
        started.set()
        assert go.wait(60)
        return solve()

    monkeypatch.setattr(workspace, "solve", slow)
    answers: list[int] = []
    asker = threading.Thread(target=lambda: answers.append(client.call("save")[0]))
    asker.start()
    assert started.wait(60)
    client.server.stop()
    go.set()
    asker.join(60)
    assert answers == [200]
    assert (workspace.task.folder / "align.json").is_file()
