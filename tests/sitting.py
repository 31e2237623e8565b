"""An observer before the page, as far as the server can tell: clips, forms, requests, votes."""

import asyncio
import hashlib

import httpx
import numpy as np

from dsis.manifest import Clip, ClipFiles, Manifest, write_manifest
from dsis.session.observing import Observation
from dsis.session.panel import enrol
from dsis.session.server import WINDOW, create_app
from dsis.session.setup import Setup, put_in_force
from dsis.session.store import open_store
from dsis.session.windows import Windows
from dsis.spec import Sequence, Session

ADDRESS = "127.0.0.1:8123"
SIZE = Sequence(width=16, height=16, fps=25.0, seconds=0.16)  # 4 frames
TIMES = {"reference_s": 0.16, "grey_s": 0.2, "test_s": 0.16, "vote_s": 1.0}
PAIR_S = 0.16 + 0.2 + 0.16 + 0.2

OBSERVER = {
    "age": "25-34",
    "expertise": "naive",
    "acuity_chart": "Landolt",
    "acuity": 1.25,
    "corrected": True,
    "colour_test": "Ishihara",
    "colour_plates": 14,
    "colour_read": 14,
    "colour_vision": "normal",
}

DISPLAY = {
    "display": {
        "model": "Sony BVM",
        "diagonal_inch": 24.5,
        "peak_cd_m2": 100,
        "distance_heights": 3,
    },
    "steps_seen": True,
    "pixels_even": True,
    "measured": {"refresh_hz": 50.0},
}

CONSENT = Setup(consent="I agree to this.", lab="TUM", hidden_references=False)

FORMS = {
    "observer": OBSERVER,
    "consent": {"sha256": CONSENT.consent_sha256},
    "display": DISPLAY,
}


def frames_of(stimulus):
    seed = int.from_bytes(stimulus.encode(), "little")
    return np.random.default_rng(seed).integers(0, 256, (4, 16, 16, 3), np.uint8)


def write_test(folder, *, hashes=True, form="player", **session):
    """Two contents with two test clips each, and one clip for training."""
    folder.mkdir(exist_ok=True)
    clips = []
    for content in ("city", "land"):
        for name in ("reference", "sd__none", "sd__bilinear", "training"):
            stimulus = f"{content}__{name}"
            data = frames_of(stimulus)
            data.tofile(folder / f"{stimulus}.rgb")
            whole = hashlib.sha256(data.tobytes()).hexdigest()
            each = tuple(hashlib.sha256(frame.tobytes()).hexdigest() for frame in data)
            files = ClipFiles(
                path=f"{stimulus}.rgb",
                sha256=whole if hashes else None,
                frame_sha256=each if hashes else (),
            )
            role = name if name in ("reference", "training") else "test"
            clips.append(
                Clip(
                    stimulus=stimulus,
                    content=content,
                    role=role,
                    reference=None if role == "reference" else f"{content}__reference",
                    files={form: files},
                )
            )
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=SIZE,
        session=Session(**{**TIMES, "training": 1, "dummies": 1, **session}),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


class Clock:
    """Seconds that pass when the test says so."""

    now = 0.0

    def __call__(self):
        return self.now


class Browser:
    """Requests of a window of a browser to the application, one at a time."""

    def __init__(self, app, token):
        self._app, self._token = app, token

    def get(self, path, **options):
        return asyncio.run(self._send("GET", path, options))

    def post(self, path, **options):
        return asyncio.run(self._send("POST", path, options))

    async def _send(self, method, path, options):
        options = {**options, "headers": {WINDOW: self._token, **options.get("headers", {})}}
        transport = httpx.ASGITransport(self._app)
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{ADDRESS}") as client:
            return await client.request(method, path, **options)


class Sitting:
    """An observer before the page, as far as the server can tell."""

    def __init__(
        self,
        folder,
        manifest,
        observer="anna",
        *,
        resume=False,
        forms=True,
        setup=None,
        player=None,
    ):
        self.said, self.clock, self.ends = [], Clock(), 0
        self.session = manifest.session
        self.store = open_store(folder, manifest)
        if setup is not None:
            put_in_force(self.store, setup, manifest.session)
        enrol(self.store, manifest, observer, resume=resume, seed=1, say=self.said.append)
        seen = Observation(
            self.store,
            manifest,
            folder,
            observer,
            say=self.said.append,
            player=player,
            clock_s=self.clock,
        )
        self.windows = Windows()
        self.app = create_app(seen, ADDRESS, when_done=self._end, windows=self.windows)
        self.http = Browser(self.app, self.windows.claim())
        if forms:
            for name in self.http.get("/api/session").json()["missing"]:
                assert self.fill(name, FORMS[name]).status_code == 200

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.store.close()

    def _end(self):
        self.ends += 1

    def fill(self, name, values):
        return self.http.post(f"/api/forms/{name}", json=values)

    def next(self):
        return self.http.get("/api/next").json()

    def start(self, presentation):
        answer = self.http.post(f"/api/presentations/{presentation['id']}/start", json={"dpr": 1})
        assert answer.status_code == 200, answer.text
        return answer.json()["showing"]

    def watch(self, presentation):
        """Begin a presentation and let its time pass."""
        showing = self.start(presentation)
        self.clock.now += sum(step["seconds"] for step in presentation["steps"])
        return showing

    def form(self, presentation, showing, vote, *, dropped=0):
        clips = [
            {
                "show": step["show"],
                "frames": [[k, 40.0 * k] for k in range(dropped, step["frames"])],
                "longest_interval_ms": 40.0,
                "hidden": False,
            }
            for step in presentation["steps"]
            if step["show"] != "grey"
        ]
        return {"showing": showing, "vote": vote, "reaction_ms": 700.5, "clips": clips}

    def vote(self, presentation, form):
        return self.http.post(f"/api/presentations/{presentation['id']}/vote", json=form)

    def judge(self, vote=5, *, dropped=0):
        """Watch and vote on what comes next; return it, or None where nothing comes."""
        presentation = self.next()
        if "done" in presentation:
            return None
        form = self.form(presentation, self.watch(presentation), vote, dropped=dropped)
        answer = self.vote(presentation, form)
        assert answer.status_code == 200, answer.text
        assert answer.json() == {"vote": vote}
        return presentation
