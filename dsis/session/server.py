"""The session in a browser: a server on the loopback address, for one observer."""

import json
import os
import socket
import webbrowser
from collections.abc import Awaitable, Callable
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
from dsis.manifest import Manifest, read_manifest
from dsis.session.clips import check_playable
from dsis.session.observing import Observation
from dsis.session.plan import draw_plan, plan_remarks
from dsis.session.store import Store, open_store

ADDRESS = "127.0.0.1"
PAGE = Path(__file__).parent / "page"
FILES = {"/": "index.html", "/player.js": "player.js", "/style.css": "style.css"}
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
    say
        Tells the experimenter the address, and what happens.

    Raises
    ------
    InputError
        The stimuli cannot be shown, the observer is there already (or, to resume, is not), or the
        port is taken.
    """
    manifest = read_manifest(folder)
    check_playable(manifest, folder)
    with _listening(port) as listening, open_store(folder, manifest) as store:
        enrol(store, manifest, observer, resume=resume, seed=seed, say=say)
        address = f"{ADDRESS}:{listening.getsockname()[1]}"
        observation = Observation(store, manifest, folder, observer, say=say)
        app = create_app(observation, address, when_done=lambda: _stop(server))
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


def enrol(
    store: Store,
    manifest: Manifest,
    observer: str,
    *,
    resume: bool,
    seed: int,
    say: Callable[[str], object],
) -> None:
    """Store a new observer with a plan, or find the one to resume; `InputError` otherwise."""
    known = store.observer(observer)
    if resume:
        if known is None or known.simulated:
            fact = f"{observer!r} has no session to resume"
            raise InputError.of(store.path, "observer", fact)
        store.log("resumed", observer=observer)
        return
    if known is not None:
        fact = f"{observer!r} is there already: take another id, or --resume"
        raise InputError.of(store.path, "observer", fact)
    plan = draw_plan(manifest, observer, seed)
    store.add_observer(observer, plan, simulated=False)
    for remark in plan_remarks(plan, manifest):
        say(f"plan: {remark}")


def create_app(
    observation: Observation, address: str, when_done: Callable[[], object] = lambda: None
) -> ASGIApp:
    """Return the application; `address` (host:port) is the only one that it answers to."""

    async def page(request: Request) -> Response:
        return FileResponse(PAGE / FILES[request.url.path])

    async def icon(_: Request) -> Response:
        return Response(status_code=204)  # browsers ask for one

    async def session(_: Request) -> Response:
        return JSONResponse(observation.describe())

    async def following(_: Request) -> Response:
        row = observation.current()
        if row is None:
            return JSONResponse({"done": True}, background=BackgroundTask(when_done))
        return JSONResponse(await run_in_threadpool(observation.presentation, row))

    async def frame(request: Request) -> Response:
        data = observation.frame(
            request.path_params["id"], request.path_params["show"], request.path_params["frame"]
        )
        return Response(data, media_type="application/octet-stream")

    async def start(request: Request) -> Response:
        showing = observation.start(request.path_params["id"], await _body(request))
        return JSONResponse({"showing": showing})

    async def vote(request: Request) -> Response:
        stands = observation.vote(request.path_params["id"], await _body(request))
        return JSONResponse({"vote": stands})

    app = Starlette(
        routes=[
            *(Route(path, page) for path in FILES),
            Route("/favicon.ico", icon),
            Route("/api/session", session),
            Route("/api/next", following),
            Route("/api/presentations/{id:int}/{show:str}/{frame:int}", frame),
            Route("/api/presentations/{id:int}/start", start, methods=["POST"]),
            Route("/api/presentations/{id:int}/vote", vote, methods=["POST"]),
        ],
        exception_handlers={InputError: _refusal(409), DamagedError: _refusal(500)},
    )
    return _Guard(app, address)


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
    listening = socket.socket()
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
