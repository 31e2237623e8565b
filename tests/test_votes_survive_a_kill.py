"""A vote that was acknowledged is there, once, whenever the session's process is killed."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from dsis.manifest import Clip, ClipFiles, Manifest, read_manifest, write_manifest
from dsis.session.store import open_store, read_store
from dsis.spec import Sequence, Session

KILLS = 20
PLANNED = 20_000

# One process imports dsis once and forks a voter for every line that it reads. A voter makes the
# store and the plan where there are none, votes on from the first presentation that has no vote, as
# a resumed session does, and writes what was acknowledged.
VOTERS = """
import os, sys
from pathlib import Path
from dsis.manifest import read_manifest
from dsis.session.plan import Presentation
from dsis.session.store import Vote, open_store

folder, planned = Path(sys.argv[1]), int(sys.argv[2])
manifest = read_manifest(folder)
plan = [Presentation(i, "test", "s", "r", i, 1, 1) for i in range(1, planned + 1)]
for line in sys.stdin:
    pid = os.fork()
    if pid:
        os.waitpid(pid, 0)
        os.write(1, b"end\\n")
        continue
    os.write(1, f"pid {os.getpid()}\\n".encode())
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


@pytest.fixture
def folder(tmp_path):
    clips = (
        Clip(stimulus="r", content="c", role="reference", files={"player": ClipFiles(path="r")}),
        Clip(stimulus="s", content="c", reference="r", files={"player": ClipFiles(path="s")}),
    )
    manifest = Manifest(
        schema="dsis-manifest/1",
        sequence=Sequence(width=8, height=8, fps=25.0, seconds=1.0),
        session=Session(),
        clips=clips,
    )
    write_manifest(manifest, tmp_path)
    return tmp_path


def _vote(line):
    _, number, vote = line.split()
    return int(number), int(vote)


def test_every_acknowledged_vote_is_there_once(folder):
    delays_s = random.Random(20)  # noqa: S311  moments, no secrets
    acknowledged = []
    with subprocess.Popen(
        [sys.executable, "-c", VOTERS, str(folder), str(PLANNED)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as voters:
        for kill in range(KILLS):
            voters.stdin.write("go\n")
            voters.stdin.flush()
            voter = int(voters.stdout.readline().split()[1])
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
