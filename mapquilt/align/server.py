"""The server of the page: on the loopback, behind a token in the address, and with no path of the page's choosing."""

from __future__ import annotations

import secrets
import socket
import threading
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass
from importlib import resources
from typing import Any

import uvicorn
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from mapping.geometry.similarity2 import Similarity2
from mapquilt.align.describe import (
    answer_record,
    candidates_record,
    cell_bytes,
    measured_record,
    shown_grid,
    solved_record,
    start_record,
    state_record,
)
from mapquilt.align.saving import exports, save
from mapquilt.align.workspace import Workspace

HOST = "127.0.0.1"
MOST_BYTES = 65_536
"""Longest body of a request: a pose and the indices of a few thousand maps."""

PAGE_FILES: Mapping[str, str] = {
    "": "text/html",
    "style.css": "text/css",
    "main.js": "text/javascript",
    "api.js": "text/javascript",
    "geometry.js": "text/javascript",
    "raster.js": "text/javascript",
    "view.js": "text/javascript",
    "panel.js": "text/javascript",
    "thumbnail.js": "text/javascript",
}
"""The files of the page, with their types; any other name is unknown."""

_HEADERS = (
    (b"cache-control", b"no-store"),
    (
        b"content-security-policy",
        b"default-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
)

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]


class Call(BaseModel):
    """A request without arguments."""

    model_config = ConfigDict(extra="forbid", strict=True)


class OfMap(Call):
    """A request about one map."""

    map: int = Field(ge=0)


class OfPair(OfMap):
    """A request about a map and another one."""

    other: int = Field(ge=0)


class Choice(OfPair):
    """The choice of a candidate of a pair."""

    number: int = Field(ge=0)


class AmongMaps(OfMap):
    """A request about a map and those that it is compared with."""

    others: list[int]


class Pose(OfMap):
    """A map and its pose on the sheet."""

    x: float = Field(ge=-1e6, le=1e6)
    y: float = Field(ge=-1e6, le=1e6)
    yaw: float = Field(ge=-1e3, le=1e3)
    scale: float = Field(gt=1e-4, lt=1e4)

    @property
    def similarity(self) -> Similarity2:
        return Similarity2(self.x, self.y, self.yaw, self.scale)


class PoseAmongMaps(Pose):
    """A pose to measure against other maps."""

    others: list[int]


class Merge(Call):
    """A merge to save; ``as_placed`` stitches the maps where they lie, ``yaw_zero`` adds the map without a yaw, and
    ``frame_of`` the one in the frame of a map."""

    as_placed: bool = False
    yaw_zero: bool = False
    frame_of: int | None = Field(default=None, ge=0)


class AlignServer:
    """Serve a workspace on a free port of the loopback, or on the one given, until ``stop`` is called."""

    def __init__(self, workspace: Workspace, port: int = 0, token: str | None = None) -> None:
        self.token = token or secrets.token_urlsafe(24)
        self._workspace, self._lock = workspace, threading.Lock()
        self._socket = _bind(port)
        self.port = int(self._socket.getsockname()[1])
        self._shown = [shown_grid(grid) for grid in workspace.maps.grids]
        self._server = uvicorn.Server(
            uvicorn.Config(
                _Guard(self._application(), self.token, (f"{HOST}:{self.port}", f"localhost:{self.port}")),
                http="h11",
                loop="asyncio",
                ws="none",
                lifespan="off",
                log_config=None,
                access_log=False,
                proxy_headers=False,
                server_header=False,
            )
        )

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def run(self) -> None:
        """Serve until the page, a signal or ``stop`` ends it; a request that runs is finished first."""
        self._server.run(sockets=[self._socket])

    def stop(self) -> None:
        """End the service after the present request."""
        self._server.should_exit = True

    def _application(self) -> Starlette:
        calls: dict[str, tuple[type[Call], Callable[[Any], dict[str, Any]]]] = {
            "place": (Pose, self._place),
            "reference": (OfMap, self._reference),
            "undo": (Call, self._undo),
            "redo": (Call, self._redo),
            "measure": (PoseAmongMaps, self._measure),
            "snap": (AmongMaps, self._snap),
            "partner": (AmongMaps, self._partner),
            "candidates": (OfPair, self._candidates),
            "choose": (Choice, self._choose),
            "solve": (Call, self._solve),
            "save": (Merge, self._save),
            "quit": (Call, self._quit),
        }
        routes = [Route(f"/{name}", self._endpoint(*call), methods=["POST"]) for name, call in calls.items()]
        routes += [Route(f"/{name}", _page(name, kind), methods=["GET"]) for name, kind in PAGE_FILES.items()]
        routes += [
            Route("/start", self._start, methods=["GET"]),
            Route("/maps/{index:int}/cells", self._cells, methods=["GET"]),
            Route("/maps/{index:int}/walls", self._walls, methods=["GET"]),
        ]
        return Starlette(routes=routes)

    def _endpoint(
        self, model: type[Call], function: Callable[[Any], dict[str, Any]]
    ) -> Callable[[Request], Awaitable[Response]]:
        def locked(call: Call) -> dict[str, Any]:
            with self._lock:
                self._require_maps(call)
                return function(call)

        async def answer(request: Request) -> Response:
            if request.headers.get("content-type") != "application/json":
                return _refused(415, "the body must be JSON")
            body = b""
            async for part in request.stream():
                body += part
                if len(body) > MOST_BYTES:
                    return _refused(413, f"the body has more than {MOST_BYTES} bytes")
            try:
                return JSONResponse(await run_in_threadpool(locked, model.model_validate_json(body)))
            except ValidationError as error:
                first = error.errors(include_url=False)[0]
                return _refused(400, f"{'.'.join(map(str, first['loc'])) or 'body'}: {first['msg']}")
            except (ValueError, OSError) as error:
                return _refused(400, str(error))

        return answer

    def _require_maps(self, call: Call) -> None:
        """Raise ``ValueError`` if a request names a map that is not there, or one as its own partner."""
        others = [*getattr(call, "others", []), *([call.other] if isinstance(call, OfPair) else [])]
        frames = [call.frame_of] if isinstance(call, Merge) and call.frame_of is not None else []
        named = [*([call.map] if isinstance(call, OfMap) else []), *others, *frames]
        most = len(self._workspace.maps)
        for index in named:
            if not 0 <= index < most:
                raise ValueError(f"map is {index}, must be 0 to {most - 1}")
        if isinstance(call, OfMap) and call.map in others:
            raise ValueError(f"map {call.map} cannot be compared with itself")

    async def _start(self, request: Request) -> Response:
        def record() -> dict[str, Any]:
            with self._lock:
                workspace = self._workspace
                shown = [each.frame for each in self._shown]
                return {**start_record(workspace, shown), "out": str(workspace.task.folder)}

        return JSONResponse(await run_in_threadpool(record))

    async def _cells(self, request: Request) -> Response:
        index = request.path_params["index"]
        if index >= len(self._shown):
            return _refused(404, f"map is {index}, must be 0 to {len(self._shown) - 1}")
        return Response(cell_bytes(self._shown[index]), media_type="application/octet-stream")

    async def _walls(self, request: Request) -> Response:
        index = request.path_params["index"]
        if index >= len(self._shown):
            return _refused(404, f"map is {index}, must be 0 to {len(self._shown) - 1}")

        def walls() -> bytes:
            with self._lock:
                return self._workspace.measurer.wall_points(index).astype("<f4").tobytes()

        return Response(await run_in_threadpool(walls), media_type="application/octet-stream")

    def _state(self, **further: Any) -> dict[str, Any]:
        return {"state": state_record(self._workspace), **further}

    def _place(self, call: Pose) -> dict[str, Any]:
        self._workspace.place(call.map, call.similarity)
        return self._state()

    def _reference(self, call: OfMap) -> dict[str, Any]:
        self._workspace.change(self._workspace.arrangement.with_reference(call.map))
        return self._state()

    def _undo(self, call: Call) -> dict[str, Any]:
        self._workspace.undo()
        return self._state()

    def _redo(self, call: Call) -> dict[str, Any]:
        self._workspace.redo()
        return self._state()

    def _measure(self, call: PoseAmongMaps) -> dict[str, Any]:
        return measured_record(self._workspace, call.map, call.similarity, call.others)

    def _snap(self, call: AmongMaps) -> dict[str, Any]:
        other = self._workspace.partner(call.map, call.others)
        answer = self._workspace.snap(call.map, other)
        return self._state(answer=answer_record(self._workspace, answer), other=other)

    def _partner(self, call: AmongMaps) -> dict[str, Any]:
        return {"other": self._workspace.partner(call.map, call.others)}

    def _candidates(self, call: OfPair) -> dict[str, Any]:
        return candidates_record(self._workspace, call.map, call.other)

    def _choose(self, call: Choice) -> dict[str, Any]:
        self._workspace.choose(call.map, call.other, call.number)
        return self._state()

    def _solve(self, call: Call) -> dict[str, Any]:
        solved = self._workspace.solve()
        return self._state(exports=exports(self._workspace, solved))

    def _save(self, call: Merge) -> dict[str, Any]:
        solved = self._workspace.stitch() if call.as_placed else self._workspace.solve()
        written = save(self._workspace, solved, yaw_zero=call.yaw_zero, frame_of=call.frame_of)
        return self._state(
            files=sorted(path.name for path in written if path.parent == self._workspace.task.folder),
            answer=solved_record(self._workspace, solved.result.pairs, solved.result.left_out),
            exports=exports(self._workspace, solved),
        )

    def _quit(self, call: Call) -> dict[str, Any]:
        self.stop()
        return {}


@dataclass(frozen=True)
class _Guard:
    """Let requests pass that name this host and the token; the application sees the rest of the path.

    A page of another site can neither know the token nor, by a name that leads to the loopback, pass for this host.
    """

    application: Starlette
    token: str
    hosts: tuple[str, ...]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return

        async def with_headers(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", ()), *_HEADERS]
            await send(message)

        refusal = self._refusal(scope)
        if refusal is not None:
            await refusal(scope, receive, with_headers)
            return
        path = scope["path"].removeprefix(f"/{self.token}")
        await self.application({**scope, "path": path, "root_path": ""}, receive, with_headers)

    def _refusal(self, scope: Scope) -> Response | None:
        headers = [(name, value.decode("latin-1")) for name, value in scope["headers"]]
        hosts = [value for name, value in headers if name == b"host"]
        origins = [value for name, value in headers if name == b"origin"]
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return _refused(421, "the host must be the loopback, by its number or as localhost")
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            return _refused(403, "another page may not ask")
        given = scope["path"].split("/")[1]
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return PlainTextResponse("The address lacks the token that mapquilt align printed.\n", 404)
        return None


def _refused(status: int, message: str) -> JSONResponse:
    return JSONResponse({"error": message}, status)


def _page(name: str, kind: str) -> Callable[[Request], Awaitable[Response]]:
    content = (resources.files("mapquilt.align") / "page" / (name or "index.html")).read_bytes()

    async def answer(request: Request) -> Response:
        return Response(content, media_type=kind)

    return answer


def _bind(port: int) -> socket.socket:
    """Listen on a port of the loopback, 0 for a free one. Raises ``ValueError`` naming one that is taken."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        listener.listen()  # so that a browser which opens the page at once waits for it
    except OSError as error:
        listener.close()
        raise ValueError(f"--port {port}: {error.strerror}; choose another, or 0 for a free one") from None
    return listener
