"""A vote that was acknowledged is there, once, whenever the session's process is killed."""

import http.client
import json
import os
import random
import signal
import socket
import subprocess
import sys
import time

import pytest

from dsis.manifest import Clip, ClipFiles, Manifest, read_manifest, write_manifest
from dsis.session.store import open_store, read_store
from dsis.spec import Sequence, Session

KILLS = 20
VOTES_PER_LIFE = 8
PLANNED = 20_000

# One process imports dsis once and forks another for every line that it reads: it says who that is,
# and when it has ended.
FORKS = """
import os, sys
from pathlib import Path
{prepare}
for line in sys.stdin:
    pid = os.fork()
    if pid:
        os.waitpid(pid, 0)
        os.write(1, b"end\\n")
        continue
    os.write(1, f"pid {{os.getpid()}}\\n".encode())
    live(line)
    os._exit(0)
"""

# A voter makes the store and the plan where there are none, votes on from the first presentation
# that has no vote, as a resumed session does, and writes what was acknowledged.
VOTERS = FORKS.format(
    prepare="""
from dsis.manifest import read_manifest
from dsis.session.plan import Presentation
from dsis.session.store import Vote, open_store

folder, planned = Path(sys.argv[1]), int(sys.argv[2])
manifest = read_manifest(folder)
plan = [Presentation(i, "test", "s", "r", i, 1, 1) for i in range(1, planned + 1)]

def live(line):
    with open_store(folder, manifest) as store:
        if store.observer("anna") is None:
            store.add_observer("anna", plan, simulated=False)
        number = next(row.id for row in store.rows() if row.vote is None)
        while True:
            vote = Vote(number % 10 + 1, 1.0, "2026-03-01T09:30:00+01:00", True, 0, False)
            store.record_vote(number, vote, details={"clips": ["x" * 400]})
            os.write(1, f"vote {number} {vote.vote}\\n".encode())
            number += 1
"""
)

# A server is new, or resumed.
SERVERS = FORKS.format(
    prepare="""
from dsis.session import serve

def live(line):
    folder, port = Path(sys.argv[1]), int(sys.argv[2])
    serve(folder, "anna", port=port, open_browser=False, resume=line == "resume\\n", say=len)
"""
)

CLIPS = (
    Clip(stimulus="r", content="c", role="reference", files={"player": ClipFiles(path="r")}),
    Clip(stimulus="s", content="c", reference="r", files={"player": ClipFiles(path="s")}),
)


def forking(program, *arguments):
    return subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def fork(process, line):
    """Have one more forked; return its number."""
    process.stdin.write(f"{line}\n")
    process.stdin.flush()
    return int(process.stdout.readline().split()[1])


@pytest.fixture
def folder(tmp_path):
    manifest = Manifest(
        schema="dsis-manifest/1",
        sequence=Sequence(width=8, height=8, fps=25.0, seconds=1.0),
        session=Session(),
        clips=CLIPS,
    )
    write_manifest(manifest, tmp_path)
    return tmp_path


def _vote(line):
    _, number, vote = line.split()
    return int(number), int(vote)


def test_every_acknowledged_vote_is_there_once(folder):
    delays_s = random.Random(20)  # noqa: S311  moments, no secrets
    acknowledged = []
    with forking(VOTERS, folder, PLANNED) as voters:
        for kill in range(KILLS):
            voter = fork(voters, "go")
            if kill % 2:  # every other voter lives to its first vote, however slow the machine
                acknowledged.append(_vote(voters.stdout.readline()))
            time.sleep(delays_s.uniform(0.0, 0.2))
            os.kill(voter, signal.SIGKILL)
            while (line := voters.stdout.readline()) != "end\n":
                acknowledged.append(_vote(line))
            with open_store(folder, read_manifest(folder)) as store:
                store.check()
        voters.stdin.close()

    with read_store(folder) as store:
        store.check()
        stored = {row.id: row.vote.vote for row in store.rows() if row.vote is not None}
    assert len(acknowledged) >= KILLS // 2
    assert len({number for number, _ in acknowledged}) == len(acknowledged)
    assert all(stored[number] == vote for number, vote in acknowledged)
    # each kill may fall between the commit and the acknowledgement of one vote, not of two
    assert 0 <= len(stored) - len(acknowledged) <= KILLS
    assert sorted(stored) == list(range(1, len(stored) + 1))


FORMS = {
    "observer": {
        "age": "not said",
        "expertise": "naive",
        "acuity_chart": "not tested",
        "corrected": False,
        "colour_test": "not tested",
        "colour_vision": "not tested",
    },
    "display": {
        "display": {"model": "x", "diagonal_inch": 1, "peak_cd_m2": 1, "distance_heights": 1},
        "steps_seen": True,
        "pixels_even": True,
        "measured": {},
    },
}


class Window:
    """A page that shows nothing and votes at once, on one connection that may break anywhere."""

    def __init__(self, port, until):
        while True:
            try:
                self._held = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                self._held.request("GET", "/api/window")
                self._stream = self._held.getresponse()
                if self._stream.status == 200:
                    break
            except OSError:
                assert time.monotonic() < until, "the server does not start"
            time.sleep(0.005)
        self._token = self._stream.readline().decode().strip()
        self._http = http.client.HTTPConnection("127.0.0.1", port, timeout=20)

    def ask(self, path, body=None):
        text = None if body is None else json.dumps(body)
        method = "GET" if body is None else "POST"
        self._http.request(method, path, text, {"X-Dsis-Window": self._token})
        answer = self._http.getresponse()
        values = json.loads(answer.read())
        assert answer.status == 200, values
        return values

    def close(self):
        self._http.close()
        self._held.close()


def vote_on(window, acknowledged, most):
    """Fill the forms, then vote until the test is done; False: the server went away before.

    After `most` votes wait for the server to go, so that there is always a vote left to lose.
    """
    votes = 0
    try:
        for name in window.ask("/api/session")["missing"]:
            window.ask(f"/api/forms/{name}", FORMS[name])
        while "done" not in (presentation := window.ask("/api/next")):
            if votes == most:
                time.sleep(0.001)
                continue
            here = f"/api/presentations/{presentation['id']}"
            showing = window.ask(f"{here}/start", {})["showing"]
            clips = [{"show": show, "frames": [[0, 0.0]]} for show in ("reference", "test")]
            vote = presentation["id"] % 10 + 1
            form = {"showing": showing, "vote": vote, "reaction_ms": 1.0, "clips": clips}
            window.ask(f"{here}/vote", form)
            acknowledged.append((presentation["id"], vote))
            votes += 1
    except (OSError, http.client.HTTPException):
        return False
    return True


def write_quick_test(folder, planned):
    """Clips of one frame that are over at once, judged so often."""
    (folder / "r").write_bytes(bytes(192))
    (folder / "s").write_bytes(bytes([9]) * 192)
    session = Session(
        variant="I",
        repetitions=planned,
        training=0,
        dummies=0,
        session_minutes_max=1e6,
        **dict.fromkeys(("reference_s", "test_s", "grey_s", "vote_s"), 0.001),
    )
    manifest = Manifest(
        schema="dsis-manifest/1",
        sequence=Sequence(width=8, height=8, fps=1000.0, seconds=0.001),
        session=session,
        clips=CLIPS,
    )
    write_manifest(manifest, folder)


def kill_servers(folder, kills, planned, seed, tell=lambda _: None):
    """Kill the server so often while votes arrive; return the votes that were acknowledged."""
    write_quick_test(folder, planned)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    delays_s = random.Random(seed)  # noqa: S311  moments, no secrets
    acknowledged = []
    with forking(SERVERS, folder, port) as servers:
        for kill in range(kills + 1):
            server = fork(servers, "resume" if kill else "new")
            window = Window(port, time.monotonic() + 60)
            if kill < kills:
                moment_s = delays_s.uniform(0.0, 0.15)
                killer = subprocess.Popen(["sh", "-c", f"sleep {moment_s:.4f}; kill -9 {server}"])
            done = vote_on(window, acknowledged, VOTES_PER_LIFE if kill < kills else planned)
            window.close()
            assert done == (kill == kills)
            if kill < kills:
                killer.wait()
            assert servers.stdout.readline() == "end\n"
            with open_store(folder, read_manifest(folder)) as store:
                store.check()
            tell(kill)
        servers.stdin.close()
    return acknowledged


def check_after_kills(folder, acknowledged, kills, planned):
    """Every acknowledged vote is there, once, and the plan is complete."""
    with read_store(folder) as store:
        store.check()
        rows = store.rows("anna")
        assert len(store.events("resumed")) == kills
    assert len(rows) == planned
    assert all(row.vote is not None and row.vote.valid for row in rows)
    stored = {row.id: row.vote.vote for row in rows}
    assert len({number for number, _ in acknowledged}) == len(acknowledged)
    assert all(stored[number] == vote for number, vote in acknowledged)
    # each kill may fall between the commit and the acknowledgement of one vote, not of two
    assert 0 <= planned - len(acknowledged) <= kills


def test_a_killed_server_loses_and_doubles_no_vote(tmp_path):
    planned = KILLS * VOTES_PER_LIFE + 10
    acknowledged = kill_servers(tmp_path, KILLS, planned, seed=7)
    check_after_kills(tmp_path, acknowledged, KILLS, planned)
