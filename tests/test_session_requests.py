"""Promise: only the window that holds the session, on this machine, is answered."""

import pytest

from dsis.errors import InputError
from dsis.session.windows import Windows
from sitting import ADDRESS, OBSERVER, Browser, Sitting, write_test


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "stimuli"


@pytest.fixture
def sitting(folder):
    with Sitting(folder, write_test(folder)) as found:
        yield found


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


@pytest.mark.parametrize("body", [b"", b"{", b"[1]", b'"x"', b'{"dpr": 1e999}', b'{"dpr": NaN}'])
def test_bodies_that_are_no_objects_are_refused(sitting, body):
    url = f"/api/presentations/{sitting.next()['id']}/start"
    assert sitting.http.post(url, content=body).status_code == 409
    # Nothing of it may stay in the log, which no one could repair: the session goes on.
    assert sitting.http.post(url, json={"dpr": 1}).status_code == 200


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
