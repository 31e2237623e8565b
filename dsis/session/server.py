"""The session in a browser: a server on the loopback address, for one observer."""

import asyncio
import json
import os
import socket
import webbrowser
from collections.abc import Awaitable, Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from dsis.errors import DamagedError, InputError
from dsis.manifest import read_manifest
from dsis.session.clips import check_playable, prepare_clips
from dsis.session.memory import available_memory_bytes, check_memory, clips_kept
from dsis.session.observing import Observation
from dsis.session.panel import enrol, held
from dsis.session.player import Player
from dsis.session.setup import Setup, put_in_force
from dsis.session.store import open_store
from dsis.session.windows import Windows

ADDRESS = "127.0.0.1"
WINDOW = "x-dsis-window"
"""Header by which a request says which window it comes from."""

_LEAVING_S = 0.5  # how long an open page may keep a server that is stopped

PAGE = Path(__file__).parent / "page"
FILES = {"/": "index.html"} | {
    f"/{name}": name
    for name in (
        "style.css",
        "api.js",
        "ballot.js",
        "clips.js",
        "display.js",
        "dom.js",
        "forms.js",
        "session.js",
    )
}
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; frame-ancestors 'none'; form-action 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Embedder-Policy": "require-corp",
    "X-Content-Type-Options": "nosniff",
}


def serve(
    folder: Path,
    observer: str,
    *,
    port: int = 0,
    open_browser: bool = True,
    resume: bool = False,
    seed: int = 1,
    setup: Setup | None = None,
    player: Player | None = None,
    say: Callable[[str], object] = print,
) -> None:
    """Hold the session of one observer in the browser; return when it is done or interrupted.

    Parameters
    ----------
    folder
        The stimuli folder.
    observer
        Pseudonym.
    port
        Port on 127.0.0.1; 0: any that is free.
    open_browser
        Open the page in the default browser.
    resume
        Go on with an observer who has begun; without it, such an observer is refused.
    seed
        Of the plan; a plan that is there already stays.
    setup
        The laboratory's, in force from now on; None: as it was.
    player
        Shows the clips, and is closed at the end; None: the page does.
    say
        Tells the experimenter the address, and what happens.

    Raises
    ------
    InputError
        The stimuli cannot be shown, the observer is there already (or, to resume, is not), or the
        port is taken.
    """
    with ExitStack() as stack:
        if player is not None:
            stack.callback(player.close)
        manifest = read_manifest(folder)
        check_playable(manifest, folder)
        available = available_memory_bytes()
        if player is None:
            check_memory(manifest, folder, available)
        prepare_clips(manifest, folder, say)
        listening = stack.enter_context(_listening(port))
        stack.enter_context(held(folder, observer))
        store = stack.enter_context(open_store(folder, manifest))
        if setup is not None:
            put_in_force(store, setup, manifest.session)
        enrol(store, manifest, observer, resume=resume, seed=seed, say=say)
        address = f"{ADDRESS}:{listening.getsockname()[1]}"
        kept = clips_kept(manifest, available)
        observation = Observation(
            store, manifest, folder, observer, say=say, player=player, clips_kept=kept
        )
        app = create_app(
            observation,
            address,
            when_done=lambda: _stop(server),
            leaving=lambda: server.should_exit,
        )
        server = uvicorn.Server(
            uvicorn.Config(app, log_level="warning", access_log=False, timeout_graceful_shutdown=2)
        )
        say(f"{observer}: http://{address}/")
        if open_browser:
            webbrowser.open(f"http://{address}/")
        try:
            server.run(sockets=[listening])
        except KeyboardInterrupt:
            say(f"stopped; to go on: dsis session {folder} --observer {observer} --resume")
        else:
            say(f"{observer}: done")


def create_app(  # noqa: C901  one small function a route
    observation: Observation,
    address: str,
    *,
    when_done: Callable[[], object] = lambda: None,
    leaving: Callable[[], bool] = lambda: False,
    windows: Windows | None = None,
) -> ASGIApp:
    """Return the application.

    Parameters
    ----------
    observation
        The test of the observer.
    address
        host:port, the only one that is answered to.
    when_done
        Called once the page knows that the test is done.
    leaving
        Whether the server is about to stop.
    windows
        Which window holds the session; None: nobody yet.
    """
    window = windows or Windows()

    async def page(request: Request) -> Response:
        return FileResponse(PAGE / FILES[request.url.path])

    async def icon(_: Request) -> Response:
        return Response(status_code=204)  # browsers ask for one

    async def session(_: Request) -> Response:
        return JSONResponse(observation.describe())

    async def form(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        missing = observation.fill(request.path_params["name"], await _body(request))
        return JSONResponse({"missing": missing})

    async def following(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        row = observation.current()
        if row is None:
            return JSONResponse({"done": True}, background=BackgroundTask(when_done))
        return JSONResponse(await run_in_threadpool(observation.presentation, row))

    async def frame(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        data = observation.frame(
            request.path_params["id"], request.path_params["show"], request.path_params["frame"]
        )
        return Response(data, media_type="application/octet-stream")

    async def start(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        showing = observation.start(request.path_params["id"], await _body(request))
        return JSONResponse({"showing": showing})

    async def show(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        number = request.path_params["showing"]
        await run_in_threadpool(observation.show, request.path_params["id"], number)
        return JSONResponse({"shown": number})

    async def vote(request: Request) -> Response:
        window.check(request.headers.get(WINDOW))
        stands = observation.vote(request.path_params["id"], await _body(request))
        return JSONResponse({"vote": stands})

    here = "/api/presentations/{id:int}"
    app = Starlette(
        routes=[
            *(Route(path, page) for path in FILES),
            Route("/favicon.ico", icon),
            Route("/api/window", _Window(window, leaving)),
            Route("/api/session", session),
            Route("/api/forms/{name:str}", form, methods=["POST"]),
            Route("/api/next", following),
            Route(here + "/{show:str}/{frame:int}", frame),
            Route(here + "/start", start, methods=["POST"]),
            Route(here + "/show/{showing:int}", show, methods=["POST"]),
            Route(here + "/vote", vote, methods=["POST"]),
        ],
        exception_handlers={InputError: _refusal(409), DamagedError: _refusal(500)},
    )
    return _Guard(app, address)


class _Window:
    """Gives the session to a page for as long as the page keeps this connection.

    The token is the first line of an answer that never ends.
    """

    def __init__(self, windows: Windows, leaving: Callable[[], bool]) -> None:
        self._windows, self._leaving = windows, leaving

    async def __call__(self, _: Scope, receive: Receive, send: Send) -> None:
        token = self._windows.claim()
        try:
            headers = [(b"content-type", b"text/plain")]
            await send({"type": "http.response.start", "status": 200, "headers": headers})
            line = f"{token}\n".encode()
            await send({"type": "http.response.body", "body": line, "more_body": True})
            while not self._leaving():
                with suppress(TimeoutError):
                    message = await asyncio.wait_for(receive(), _LEAVING_S)
                    if message["type"] == "http.disconnect":
                        break
        finally:
            self._windows.release(token)


class _Guard:
    """Answers the page of this server and nobody else, and keeps other pages out of it.

    A foreign page can send requests to a loopback address, under its own name (Origin) or through
    a name of its own that it lets point here (Host).
    """

    def __init__(self, app: ASGIApp, address: str) -> None:
        port = address.rpartition(":")[2]
        self._app = app
        self._hosts = {f"{ADDRESS}:{port}", f"localhost:{port}"}
        self._origins = {f"http://{host}" for host in self._hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        origin = headers.get("origin")
        if headers.get("host") not in self._hosts or origin not in (None, *self._origins):
            refusal = PlainTextResponse("this address is for the session page only", 403)
            await refusal(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        await self._app(scope, receive, send_guarded)


def _refusal(status: int) -> Callable[[Request, Exception], Awaitable[Response]]:
    async def refuse(_: Request, error: Exception) -> Response:
        return JSONResponse({"error": str(error)}, status)

    return refuse


async def _body(request: Request) -> dict[str, Any]:
    try:
        body = json.loads(await request.body())
        # 1e999 reads as infinity, which the log could hold but nobody could read again.
        json.dumps(body, allow_nan=False)
    except ValueError:
        raise InputError.of("request", "", "is not JSON of finite numbers") from None
    if not isinstance(body, dict):
        raise InputError.of("request", "", "must be a JSON object")
    return body


def _listening(port: int) -> socket.socket:
    # asyncio switches Nagle's algorithm off (40 ms a request) only where the protocol is named.
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    if (
        os.name == "posix"
    ):  # the port of a session that has just ended is free; elsewhere it means more
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((ADDRESS, port))
        listening.listen()  # from here on a browser waits, however long the server takes to start
    except (OSError, OverflowError) as error:
        listening.close()
        raise InputError.of("port", "", f"{port} cannot be used: {error}") from None
    return listening


def _stop(server: uvicorn.Server) -> None:
    server.should_exit = True
