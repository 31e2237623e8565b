"""Promise: the page gets the clips of the plan, one after the other, to the end of the session."""

import hashlib
import json
import threading
import time
import urllib.error
import urllib.request

import pytest

from dsis.errors import InputError
from dsis.session import serve, status
from dsis.session.server import WINDOW
from dsis.session.store import STORE, read_store
from sitting import FORMS, PAIR_S, Sitting, frames_of, write_test


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


def test_the_page_and_its_parts_are_served_and_never_stored(sitting):
    for path, kind in (("/", "html"), ("/session.js", "javascript"), ("/style.css", "css")):
        answer = sitting.http.get(path)
        assert answer.status_code == 200
        assert kind in answer.headers["content-type"]
        assert answer.headers["cache-control"] == "no-store"
        assert "default-src 'self'" in answer.headers["content-security-policy"]
    assert "#7e7e7e" in sitting.http.get("/style.css").text


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
