"""The server of the page: files in, files out, and one command at a time (`realtime.pages` guards the door).

Only who was given the address that was printed is served: its key becomes a cookie that no other site can send along.
Pages from the folder are shown apart from this one: they may run their own scripts and reach nothing.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from fastapi import FastAPI, Request, Response, WebSocket
from starlette.responses import FileResponse, JSONResponse, RedirectResponse

from ..core.errors import RequestError
from ..core.files import write_whole
from ..data import DataError
from ..realtime.pages import admitted, application, attend, body, close, same_origin, server
from ..ships.files import library
from .actions import ACTIONS, command
from .jobs import Jobs
from .shelf import inside, place_of, shelf
from .view import cut, drawn

STATIC = Path(__file__).with_name("static")
"""The page's own files; nothing is fetched from elsewhere."""

_COOKIE = "seatrial-open"
_PIECE = 4 * 2**20
"""Largest piece of a dropped file [bytes]; a large file comes in many."""
_TEXT = 2**20
"""Largest text that is edited on the page [bytes]."""
_APART = {
    "Content-Security-Policy": "sandbox allow-scripts allow-downloads; default-src 'none'; style-src 'unsafe-inline'; "
                               "script-src 'unsafe-inline'; img-src data: blob:; frame-ancestors 'self'",
}  # fmt: skip


def desk(folder: Path, jobs: Jobs, key: str) -> FastAPI:
    """The page of a folder.

    Args:
        jobs: runs its commands.
        key: who does not have it is not served.
    """

    def routes(app: FastAPI) -> None:
        _guard(app, key)
        _reading(app, folder, jobs)
        _writing(app, folder)
        _doing(app, folder, jobs)

    return application(STATIC, _silent, links=(routes,))


def serve(folder: Path, listening: socket.socket, key: str) -> None:
    """Serve the page of a folder until Ctrl-C; its commands are interrupted then."""
    jobs = Jobs(folder)
    try:
        with suppress(KeyboardInterrupt):
            asyncio.run(attend(server(desk(folder, jobs, key)), listening))
    finally:
        jobs.close()


async def _silent(ws: WebSocket) -> None:
    await ws.accept()
    await close(ws, "this page has no line")


def _guard(app: FastAPI, key: str) -> None:
    """Serve whoever brings the key: once in the address, then in a cookie; changes only for this very page."""

    @app.middleware("http")
    async def known(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        given = request.query_params.get("key")
        if given is not None and admitted(key, given):
            there = RedirectResponse(request.url.path, 303)
            there.set_cookie(_COOKIE, key, httponly=True, samesite="lax")
            return there
        if not admitted(key, request.cookies.get(_COOKIE)):
            return _refused("open the address that seatrial open has printed: it holds a key", 403)
        if request.method not in ("GET", "HEAD") and not same_origin(request.headers):
            return _refused("another page cannot change this folder", 403)
        return await go_on(request)

    @app.exception_handler(RequestError)
    async def refused(_: Request, error: Exception) -> Response:
        return _refused(str(error), 400)

    @app.exception_handler(DataError)
    async def unread(_: Request, error: Exception) -> Response:
        return _refused(str(error), 400)


def _refused(why: str, status: int) -> Response:
    return JSONResponse({"error": why}, status)


def _reading(app: FastAPI, folder: Path, jobs: Jobs) -> None:
    @app.get("/api/shelf")
    def what_is_there() -> dict[str, Any]:
        return {"folder": folder.name or str(folder), "items": [vars(one) for one in shelf(folder)],
                "jobs": jobs.every()}  # fmt: skip

    @app.get("/api/catalogue")
    def what_can_be_done() -> dict[str, Any]:
        actions = [{"key": one.key, "title": one.title, "about": one.about, "fields": [vars(f) for f in one.fields]}
                   for one in ACTIONS.values()]  # fmt: skip
        return {"actions": actions, "ships": sorted(library())}

    @app.get("/api/trial/{path:path}")
    def a_trial(path: str) -> dict[str, Any]:
        return drawn(_there(folder, path))

    @app.get("/api/text/{path:path}")
    def a_text(path: str) -> dict[str, str]:
        return {"text": _text(_there(folder, path))}

    @app.get("/files/{path:path}")
    def a_file(path: str) -> Response:
        there = _there(folder, path)
        if there.suffix.lower() in (".html", ".htm", ".svg", ".xml"):
            return FileResponse(there, headers=_APART)
        return FileResponse(there, media_type="application/octet-stream", filename=there.name)


def _writing(app: FastAPI, folder: Path) -> None:
    @app.put("/api/files/{name:path}")
    async def a_piece(name: str, request: Request, at: int = 0, last: bool = True) -> dict[str, str]:
        """A piece of a dropped file: it has its name when its last piece is there."""
        there = inside(folder, place_of(name))
        try:
            piece = await body(request, _PIECE)
        except ValueError as error:
            raise RequestError(f"{name}: {error}") from None
        return {"path": await asyncio.to_thread(_kept, folder, there, piece, at, last)}

    @app.put("/api/text/{path:path}")
    async def a_new_text(path: str, request: Request) -> dict[str, str]:
        """An edited text, unless the file is another one than was read."""
        there, said = _there(folder, path), await _said(request, 2 * _TEXT)
        text, was = said.get("text"), said.get("was")
        if not isinstance(text, str) or not isinstance(was, str):
            raise RequestError("a text takes 'text' and 'was'")
        if _text(there) != was:
            raise RequestError(f"{path} has changed since it was opened: copy your text, and open the file again")
        write_whole(there, text)
        return {"path": path}

    @app.post("/api/cut")
    async def a_cut(request: Request) -> dict[str, str]:
        said = await _said(request, _TEXT)
        name, out = str(said.get("trial", "")), str(said.get("out", ""))
        try:
            stretches = [(float(a), float(b)) for a, b in said.get("stretches", [])]
        except (TypeError, ValueError):
            raise RequestError("stretches are pairs of seconds") from None
        cut(inside(folder, out), name, stretches)
        return {"path": out}


def _doing(app: FastAPI, folder: Path, jobs: Jobs) -> None:
    @app.post("/api/command/{key}")
    async def what_would_run(key: str, request: Request, run: bool = False) -> dict[str, Any]:
        """The command of an action, which runs if `run`; before that, why there is none yet is an answer too."""
        said = await _said(request, _TEXT)
        if not run:
            try:
                return {"arguments": command(folder, key, said)[0]}
            except RequestError as error:
                return {"lacks": str(error)}
        arguments, written = command(folder, key, said)
        if written is not None:
            write_whole(inside(folder, written[0]), written[1])
        return {"number": (await asyncio.to_thread(jobs.start, arguments)).number}

    @app.get("/api/jobs/{number}")
    def a_job(number: int, since: int = 0) -> dict[str, Any]:
        return jobs.said(number, since)

    @app.post("/api/jobs/{number}/stop")
    def to_stop(number: int) -> dict[str, Any]:
        jobs.stop(number)
        return jobs.said(number, 0)


async def _said(request: Request, most: int) -> dict[str, Any]:
    """The JSON object that a request brings.

    Raises:
        RequestError: it is none, or too long.
    """
    try:
        said = json.loads(await body(request, most))
    except (ValueError, RecursionError):
        said = None
    if not isinstance(said, dict):
        raise RequestError("a request is one JSON object")
    return said


def _there(folder: Path, path: str) -> Path:
    there = inside(folder, unquote(path))
    if not there.is_file():
        raise RequestError(f"{path} is no file of this folder any more")
    return there


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(_TEXT + 1)
        if len(data) > _TEXT:
            raise RequestError(f"{path.name}: is longer than {_TEXT} bytes; edit it in an editor")
        return data.decode("utf-8")
    except UnicodeDecodeError:
        raise RequestError(f"{path.name}: is no text") from None


def _kept(folder: Path, there: Path, piece: bytes, at: int, last: bool) -> str:
    """Add a piece to a dropped file.

    Raises:
        RequestError: it does not follow the piece before, or there is such a file already.
    """
    if there.exists():
        raise RequestError(f"{there.name} is there already; rename one of the two")
    there.parent.mkdir(exist_ok=True)
    part = there.with_name(f".{there.name}.part")
    size = part.stat().st_size if part.exists() and at else 0
    if at != size:
        raise RequestError(f"{there.name}: a piece is missing; drop the file again")
    with part.open("ab" if at else "wb") as file:
        file.write(piece)
    if last:
        part.rename(there)
    return there.relative_to(folder).as_posix()


def new_key() -> str:
    """A key that cannot be guessed."""
    return secrets.token_urlsafe(18)
