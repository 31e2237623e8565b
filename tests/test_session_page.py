"""The server behind the session page: what it shows, which votes it takes, whom it refuses."""

import asyncio
import hashlib
import json
import threading
import time
import urllib.error
import urllib.request

import httpx
import numpy as np
import pytest

from dsis.errors import InputError
from dsis.manifest import Clip, ClipFiles, Manifest, write_manifest
from dsis.session import export_votes, forget, serve, status
from dsis.session.cliplog import ClipLog
from dsis.session.observing import Observation
from dsis.session.panel import enrol
from dsis.session.personal import PERSONAL, read_records
from dsis.session.server import WINDOW, create_app
from dsis.session.setup import Setup, put_in_force
from dsis.session.store import STORE, open_store, read_store
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


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "stimuli"


@pytest.fixture
def sitting(folder):
    with Sitting(folder, write_test(folder)) as found:
        yield found


def test_a_whole_session(folder, sitting):
    facts = sitting.http.get("/api/session").json()
    assert facts["scale"] == [1, 10]
    assert (facts["width"], facts["height"], facts["fps"], facts["times_shown"]) == (16, 16, 25, 2)
    assert (facts["training"], facts["begun"], facts["grey"]) == (True, False, "#7e7e7e")
    kinds = []
    for vote in range(1, 7):
        presentation = sitting.judge(vote)
        kinds.append(presentation["kind"])
    assert kinds == ["training", "dummy", "test", "test", "test", "test"]
    assert sitting.judge() is None
    assert sitting.ends == 1
    with read_store(folder) as store:
        store.check()
        votes = [row.vote for row in store.rows("anna")]
    assert [vote.vote for vote in votes] == [1, 2, 3, 4, 5, 6]
    assert all(vote.valid and vote.reaction_ms == 700.5 and not vote.simulated for vote in votes)
    assert str(status(folder)).startswith("1 of 18 observers are done")


@pytest.mark.parametrize(
    ("variant", "shown"),
    [
        ("I", ["grey", "reference", "grey", "test"]),
        ("II", ["grey", "reference", "grey", "test"] * 2),
    ],
)
def test_the_pair_is_shown_once_or_twice(folder, variant, shown):
    with Sitting(folder, write_test(folder, variant=variant)) as sitting:
        steps = sitting.next()["steps"]
    assert [step["show"] for step in steps] == shown
    assert [step["frames"] for step in steps] == [0, 4, 0, 4] * (len(shown) // 4)
    assert sum(step["seconds"] for step in steps) == pytest.approx(PAIR_S * len(shown) / 4)


def test_the_frames_are_those_of_the_file_and_carry_its_hashes(folder, sitting):
    presentation = sitting.next()
    with read_store(folder) as store:
        p = store.rows("anna")[0].presentation
    for show, stimulus in (("reference", p.reference), ("test", p.stimulus)):
        for number, frame in enumerate(frames_of(stimulus)):
            url = f"/api/presentations/{presentation['id']}/{show}/{number}"
            data = sitting.http.get(url).content
            assert data == frame.tobytes()
            assert hashlib.sha256(data).hexdigest() == presentation["sha256"][show][number]


def test_clips_are_reached_by_presentation_and_by_nothing_else(sitting):
    presentation = sitting.next()
    here = f"/api/presentations/{presentation['id']}"
    for path in (
        f"{here}/test/4",
        f"{here}/manifest.json/0",
        f"/api/presentations/{presentation['id'] + 1}/test/0",
    ):
        assert sitting.http.get(path).status_code == 409
    for path in (
        f"{here}/test/-1",
        f"{here}/..%2f..%2fmanifest.json/0",
        "/manifest.json",
        "/..%2fmanifest.json",
        "/page/../server.py",
    ):
        assert sitting.http.get(path).status_code == 404


def test_a_double_post_is_one_vote(folder, sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    for _ in range(2):
        assert sitting.vote(presentation, form).json() == {"vote": 7}
    other = sitting.vote(presentation, {**form, "vote": 8})
    assert (other.status_code, other.json()) == (409, {"error": "vote: is there already: 7"})
    with read_store(folder) as store:
        store.check()
        assert [row.vote.vote for row in store.rows() if row.vote] == [7]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"vote": 11}, "from 1 to 10"),
        ({"vote": 0}, "from 1 to 10"),
        ({"vote": 5.5}, "integer"),
        ({"vote": "5"}, "integer"),
        ({"vote": None}, "integer"),
        ({"showing": 2}, "not shown in this window"),
        ({"clips": []}, "are not those of the presentation"),
        ({"reaction_ms": -1.0}, "greater than or equal to 0"),
        ({"mos": 5}, "unknown key"),
    ],
)
def test_wrong_votes_are_refused(folder, sitting, change, why):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    answer = sitting.vote(presentation, {**form, **change})
    assert answer.status_code == 409
    assert why in answer.json()["error"]
    with read_store(folder) as store:
        assert all(row.vote is None for row in store.rows())


def test_frames_that_cannot_have_been_painted_are_refused(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    for frames in ([[0, 0.0], [0, 40.0]], [[1, 0.0], [0, 40.0]], [[4, 0.0]]):
        form["clips"][0]["frames"] = frames
        assert "frames are not in order" in sitting.vote(presentation, form).json()["error"]


def test_no_vote_before_the_clips_have_ended(sitting):
    presentation = sitting.next()
    showing = sitting.start(presentation)
    form = sitting.form(presentation, showing, 7)
    # every step of a player may end one frame (0.04 s) early, none earlier
    sitting.clock.now += 2 * PAIR_S - 8 * 0.04 - 0.01
    assert "before the clip has ended" in sitting.vote(presentation, form).json()["error"]
    sitting.clock.now += 0.02
    assert sitting.vote(presentation, form).status_code == 200


def test_no_vote_on_what_was_not_shown(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, 1, 7)
    assert "not shown in this window" in sitting.vote(presentation, form).json()["error"]
    for other in (presentation["id"] + 1, 999):
        answer = sitting.vote({"id": other}, form)
        assert answer.status_code == 409
        assert "is not the one shown now" in answer.json()["error"]
    start = sitting.http.post(f"/api/presentations/{presentation['id'] + 1}/start", json={})
    assert start.status_code == 409


def test_no_vote_on_another_observers_presentation(folder, sitting):
    manifest = write_test(folder)
    with Sitting(folder, manifest, "bert") as bert:
        theirs = bert.next()
        bert.watch(theirs)
        mine = sitting.next()
        form = sitting.form(mine, sitting.watch(mine), 3)
        assert "is not the one shown now" in sitting.vote(theirs, form).json()["error"]
    with read_store(folder) as store:
        assert all(row.vote is None for row in store.rows())


def test_a_showing_with_dropped_frames_is_kept_and_repeated(folder, sitting):
    for _ in range(2):
        sitting.judge()
    spoilt = sitting.judge(9, dropped=1)
    assert "4 frames dropped; it is repeated at the end" in sitting.said[-1]
    seen = [sitting.judge(6) for _ in range(4)]
    assert sitting.judge() is None
    with read_store(folder) as store:
        rows = store.rows("anna")
        store.check()
    first = next(row for row in rows if row.id == spoilt["id"])
    again = next(row for row in rows if row.id == seen[-1]["id"])
    assert (first.vote.vote, first.vote.valid, first.vote.dropped_frames) == (9, False, 4)
    assert again.presentation.stimulus == first.presentation.stimulus
    assert (again.presentation.attempt, again.vote.valid) == (2, True)
    (anna,) = status(folder).observers
    assert (anna.planned, anna.done, anna.invalid, anna.lost) == (7, 7, 1, 0)


def test_a_display_that_always_drops_frames_comes_to_an_end(folder, sitting):
    shown = 0
    while sitting.judge(dropped=1) is not None:
        shown += 1
        assert shown < 40
    (anna,) = status(folder).observers
    assert anna.lost == 4
    assert "not repeated" in sitting.said[-1]


def test_a_dropped_last_frame_counts_too(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    del form["clips"][-1]["frames"][-1]
    sitting.vote(presentation, form)
    assert "1 frames dropped" in sitting.said[-1]


def test_a_last_frame_that_freezes_counts_too(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    form["clips"][-1]["longest_interval_ms"] = 540.0  # 40 ms were due
    sitting.vote(presentation, form)
    assert "12 frames dropped" in sitting.said[-1]


def test_a_reload_shows_the_presentation_again_and_the_old_page_is_stale(folder, sitting):
    presentation = sitting.next()
    old = sitting.watch(presentation)
    assert sitting.next() == presentation
    new = sitting.watch(presentation)
    assert (old, new) == (1, 2)
    stale = sitting.vote(presentation, sitting.form(presentation, old, 2))
    assert "not shown in this window, or again since" in stale.json()["error"]
    assert sitting.vote(presentation, sitting.form(presentation, new, 8)).status_code == 200
    with read_store(folder) as store:
        assert len(store.events("started")) == 2
        assert [event["showing"] for event in store.events("interrupted")] == [1]


def test_resume_goes_on_with_the_interrupted_presentation(folder):
    manifest = write_test(folder)
    with Sitting(folder, manifest) as first:
        done = [first.judge(4)["id"] for _ in range(3)]
        cut = first.next()
        first.watch(cut)
    with pytest.raises(InputError, match="'anna' is there already: take another id, or --resume"):
        Sitting(folder, manifest)
    with Sitting(folder, manifest, resume=True) as second:
        assert second.http.get("/api/session").json()["begun"]
        assert second.next() == cut
        stale = second.vote(cut, second.form(cut, 1, 2))
        assert stale.status_code == 409
        rest = [second.judge(6)["id"] for _ in range(3)]
        assert second.judge() is None
    assert rest[0] == cut["id"]
    assert len({*done, *rest}) == 6
    with read_store(folder) as store:
        store.check()
        assert [row.vote.vote for row in store.rows("anna")] == [4, 4, 4, 6, 6, 6]
        assert len(store.events("interrupted")) == 1


def test_there_must_be_something_to_resume(folder):
    with pytest.raises(InputError, match="'bert' has no session to resume"):
        Sitting(folder, write_test(folder), "bert", resume=True)


@pytest.mark.parametrize(
    ("headers", "status_code"),
    [
        ({}, 200),
        ({"Origin": f"http://{ADDRESS}"}, 200),
        ({"Host": "localhost:8123", "Origin": "http://localhost:8123"}, 200),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "http://127.0.0.1:9999"}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "evil.example:8123"}, 403),
        ({"Host": "127.0.0.1"}, 403),
        ({"Host": "localhost:9999"}, 403),
    ],
)
def test_foreign_hosts_and_origins_are_refused(sitting, headers, status_code):
    assert sitting.http.get("/api/session", headers=headers).status_code == status_code
    presentation = sitting.next()
    url = f"/api/presentations/{presentation['id']}/start"
    assert sitting.http.post(url, json={}, headers=headers).status_code == status_code


def test_the_page_and_its_parts_are_served_and_never_stored(sitting):
    for path, kind in (("/", "html"), ("/session.js", "javascript"), ("/style.css", "css")):
        answer = sitting.http.get(path)
        assert answer.status_code == 200
        assert kind in answer.headers["content-type"]
        assert answer.headers["cache-control"] == "no-store"
        assert "default-src 'self'" in answer.headers["content-security-policy"]
    assert "#7e7e7e" in sitting.http.get("/style.css").text


@pytest.mark.parametrize("body", [b"", b"{", b"[1]", b'"x"', b'{"dpr": 1e999}', b'{"dpr": NaN}'])
def test_bodies_that_are_no_objects_are_refused(sitting, body):
    url = f"/api/presentations/{sitting.next()['id']}/start"
    assert sitting.http.post(url, content=body).status_code == 409
    # Nothing of it may stay in the log, which no one could repair: the session goes on.
    assert sitting.http.post(url, json={"dpr": 1}).status_code == 200


@pytest.mark.parametrize("hashes", [True, False])
def test_a_clip_that_is_not_the_manifests_is_never_shown(folder, hashes):
    manifest = write_test(folder, hashes=hashes)
    with Sitting(folder, manifest) as sitting:
        for path in folder.glob("*.rgb"):
            data = bytearray(path.read_bytes())
            data[1000] ^= 1
            path.write_bytes(data)
        answer = sitting.http.get("/api/next")
        # a manifest without hashes cannot know
        assert answer.status_code == (500 if hashes else 200)
        if hashes:
            assert "differs from the manifest in frames [1]" in answer.json()["error"]


def test_stimuli_that_cannot_be_shown_are_refused_before_anything_is_stored(folder):
    write_test(folder, form="exr")
    with pytest.raises(InputError, match=r'formats = \["player"\]'):
        serve(folder, "anna", open_browser=False)
    write_test(folder)
    (folder / "city__reference.rgb").write_bytes(b"short")
    (folder / "land__sd__none.rgb").unlink()
    with pytest.raises(InputError, match="has 5 bytes, must have 3072") as refusal:
        serve(folder, "anna", open_browser=False)
    assert "land__sd__none.rgb: is missing" in str(refusal.value)
    assert not (folder / STORE).exists()


def test_serve_listens_on_the_loopback_and_ends_when_the_test_is_done(folder):
    write_test(
        folder,
        training=0,
        dummies=0,
        repetitions=1,
        variant="I",
        **dict.fromkeys(("reference_s", "test_s", "grey_s"), 0.02),
    )
    said = []
    session = threading.Thread(
        target=serve,
        args=(folder, "anna"),
        kwargs={"open_browser": False, "say": said.append},
        daemon=True,
    )
    session.start()
    while session.is_alive() and not any("http" in line for line in said):
        time.sleep(0.01)
    url = next(line for line in said if "http" in line).split()[1].rstrip("/")

    window = urllib.request.urlopen(f"{url}/api/window", timeout=10)  # noqa: S310  http
    token = window.readline().decode().strip()

    def ask(path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{url}{path}", data, {WINDOW: token})  # noqa: S310  http
        with urllib.request.urlopen(request, timeout=10) as answer:  # noqa: S310  http
            return json.load(answer)

    with pytest.raises(urllib.error.HTTPError) as second:
        urllib.request.urlopen(f"{url}/api/window", timeout=10)  # noqa: S310  http
    assert json.load(second.value)["error"] == "window: the session is open in another window"
    for name in ("observer", "display"):
        ask(f"/api/forms/{name}", FORMS[name])

    votes = 0
    while "done" not in (presentation := ask("/api/next")):
        here = f"/api/presentations/{presentation['id']}"
        showing = ask(f"{here}/start", {})["showing"]
        time.sleep(0.1)
        clips = [
            {"show": show, "frames": [[0, 0.0]], "longest_interval_ms": 20.0, "hidden": False}
            for show in ("reference", "test")
        ]
        form = {"showing": showing, "vote": 5, "reaction_ms": 1.0, "clips": clips}
        assert ask(f"{here}/vote", form) == {"vote": 5}
        votes += 1
    session.join(timeout=20)  # although a page is still open
    assert not session.is_alive()
    window.close()
    assert votes == 4
    assert said[-1] == "anna: done"


# ---- one window


def test_only_the_window_that_holds_the_session_is_answered(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    here = f"/api/presentations/{presentation['id']}"
    other = Browser(sitting.app, "another-token")
    asked = [
        other.get("/api/next"),
        other.get(f"{here}/test/0"),
        other.post(f"{here}/start", json={}),
        other.post(f"{here}/show/1", json={}),
        other.post(f"{here}/vote", json=form),
        other.post("/api/forms/observer", json=OBSERVER),
    ]
    for answer in asked:
        assert answer.status_code == 409
        assert "does not hold the session" in answer.json()["error"]
    with pytest.raises(InputError, match="open in another window"):
        sitting.windows.claim()
    assert sitting.vote(presentation, form).json() == {"vote": 7}


def test_a_window_that_is_gone_gives_the_session_back():
    windows = Windows()
    first = windows.claim()
    windows.release("of nobody")
    windows.check(first)
    windows.release(first)
    second = windows.claim()
    assert second != first
    for stale in (first, None, ""):
        with pytest.raises(InputError, match="does not hold the session"):
            windows.check(stale)


# ---- forms


def test_nothing_is_shown_before_the_forms_are_filled(folder):
    with Sitting(folder, write_test(folder), forms=False, setup=CONSENT) as sitting:
        session = sitting.http.get("/api/session").json()
        assert session["missing"] == ["observer", "consent", "display"]
        assert session["consent"] == "I agree to this."
        presentation = sitting.next()
        url = f"/api/presentations/{presentation['id']}/start"
        for name in ("observer", "consent", "display"):
            refused = sitting.http.post(url, json={})
            assert refused.status_code == 409
            assert "first come: " in refused.json()["error"]
            missing = sitting.fill(name, FORMS[name]).json()["missing"]
            assert name not in missing
        assert sitting.http.post(url, json={}).status_code == 200


@pytest.mark.parametrize(
    ("name", "change", "why"),
    [
        ("observer", {"age": 31}, "age"),
        ("observer", {"acuity": None}, "acuity must be given"),
        ("observer", {"acuity": 40.0}, "less than or equal to 4"),
        ("observer", {"colour_read": 15}, "more than the plates shown"),
        ("observer", {"colour_plates": None}, "must be given together"),
        ("observer", {"colour_vision": "not tested"}, "colour_vision must say"),
        ("observer", {"name": "Anna Maier"}, "unknown key"),
        ("observer", {"note": "x" * 501}, "at most 500"),
        ("consent", {"sha256": "0" * 64}, "is of another text"),
        ("display", {"display": {"model": ""}}, "display.model"),
        ("display", {"steps_seen": "yes"}, "boolean"),
        ("votes", {}, "'votes' is none"),
    ],
)
def test_forms_that_are_not_whole_are_refused(folder, name, change, why):
    with Sitting(folder, write_test(folder), forms=False, setup=CONSENT) as sitting:
        values = {**FORMS.get(name, {}), **change}
        answer = sitting.fill(name, {k: v for k, v in values.items() if v is not None})
        assert answer.status_code == 409
        assert why in answer.json()["error"]
        assert sitting.http.get("/api/session").json()["missing"][0] == "observer"
    assert read_records(folder) == {}


def test_personal_data_is_kept_apart_and_can_be_erased(folder):
    marker = "wears-a-red-hat"
    with Sitting(folder, write_test(folder), forms=False) as sitting:
        record = {**OBSERVER, "note": marker, "acuity": 0.7, "colour_vision": "deficient"}
        assert sitting.fill("observer", record).status_code == 200
        assert sitting.fill("display", DISPLAY).status_code == 200
        assert "anna: visual acuity is 0.7, below 1" in sitting.said
        assert "anna: colour vision: deficient" in sitting.said
        while sitting.judge() is not None:
            pass
    votes = b"".join(path.read_bytes() for path in (folder / "session").glob("votes*"))
    assert marker.encode() not in votes
    assert b"Landolt" not in votes
    assert read_records(folder)["anna"][1].acuity == 0.7

    out = folder.parent / "votes"
    export_votes(folder, out)
    assert not (out / "people.csv").exists()
    assert all(marker.encode() not in path.read_bytes() for path in out.iterdir())
    export_votes(folder, out, personal=True)
    assert marker in (out / "people.csv").read_text(encoding="utf-8")
    export_votes(folder, out)  # an export with personal data can be replaced by one without
    assert not (out / "people.csv").exists()

    forget(folder, "anna")
    assert read_records(folder) == {}
    assert marker.encode() not in (folder / PERSONAL).read_bytes()
    with pytest.raises(InputError, match="holds nothing about 'anna'"):
        forget(folder, "anna")


# ---- a player of its own


class Program:
    """A player that shows nothing and drops as many frames as it is told."""

    def __init__(self):
        self.dropped, self.shown = 0, []

    def describe(self):
        return {"player": "none", "version": "1"}

    def show(self, steps, clips):
        self.shown.append([step.show for step in steps])
        assert all(len(clip.frame_sha256) == 4 for clip in clips.values())
        whole = [step.show for step in steps if step.show != "grey"]
        return tuple(ClipLog(show=show, dropped=self.dropped) for show in whole)

    def close(self):
        pass


def test_another_player_shows_the_clips_and_counts_the_frames(folder):
    program = Program()
    with Sitting(folder, write_test(folder, training=0, dummies=0), player=program) as sitting:
        assert sitting.http.get("/api/session").json()["player"] == "program"
        for number in range(5):
            program.dropped = int(number == 0)
            presentation = sitting.next()
            showing = sitting.start(presentation)
            form = {"showing": showing, "vote": 3, "reaction_ms": 1.0}
            sitting.clock.now += 60
            early = sitting.vote(presentation, form)
            assert "are not those of the presentation" in early.json()["error"]
            url = f"/api/presentations/{presentation['id']}/show"
            assert sitting.http.post(f"{url}/{showing + 1}", json={}).status_code == 409
            assert sitting.http.post(f"{url}/{showing}", json={}).status_code == 200
            claimed = sitting.form(presentation, showing, 3)
            assert "another program" in sitting.vote(presentation, claimed).json()["error"]
            assert sitting.vote(presentation, form).json() == {"vote": 3}
        assert "done" in sitting.next()
    assert program.shown == [["grey", "reference", "grey", "test"] * 2] * 5
    with read_store(folder) as store:
        votes = [row.vote for row in store.rows("anna")]
        assert [vote.dropped_frames for vote in votes] == [4, 0, 0, 0, 0]
        assert [vote.valid for vote in votes] == [False, True, True, True, True]
        assert store.events("display")[0]["player"] == {"player": "none", "version": "1"}


def test_a_player_shows_one_thing_at_a_time_however_often_a_page_is_reloaded(folder):
    class Slow(Program):
        now = most = 0

        def show(self, steps, clips):
            self.now += 1
            self.most = max(self.most, self.now)
            time.sleep(0.2)
            self.now -= 1
            return super().show(steps, clips)

    program = Slow()
    with Sitting(folder, write_test(folder, training=0, dummies=0), player=program) as sitting:
        presentation = sitting.next()
        url = f"/api/presentations/{presentation['id']}/show"
        first = sitting.start(presentation)
        left = threading.Thread(
            target=sitting.http.post, args=(f"{url}/{first}",), kwargs={"json": {}}
        )
        left.start()
        time.sleep(0.1)
        second = sitting.start(presentation)  # the page was reloaded
        assert sitting.http.post(f"{url}/{second}", json={}).status_code == 200
        left.join()
    assert program.most == 1
    assert len(program.shown) == 2


def test_a_page_cannot_state_its_own_count_of_dropped_frames(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    form["clips"][0] = {"show": "reference", "dropped": 0}
    assert "without counters" in sitting.vote(presentation, form).json()["error"]
