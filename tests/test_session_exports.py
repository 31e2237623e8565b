"""Promise: a session exports every vote and frame, and its status tells what may spoil it."""

import gzip
import json
import sqlite3

import pytest

from dsis.errors import DamagedError
from dsis.manifest import read_manifest
from dsis.session import export_votes, plan_panel, status
from dsis.session.store import STORE, Vote, open_store
from tiny_clips import NOW, table, write_test


@pytest.fixture
def folder(tmp_path):
    write_test(tmp_path / "stimuli")
    return tmp_path / "stimuli"


def watched(store, row, vote, **display):
    """Store a vote on a presentation that was shown by the page."""
    store.log("started", presentation=row.id, showing=1, display=display)
    clip = {"longest_interval_ms": 41.5, "hidden": False, "dropped": None, "counters": {}}
    logs = [
        {"show": show, "frames": [[0, 0.0], [1, 40.0]], **clip} for show in ("reference", "test")
    ]
    details = {"showing": 1, "clips": logs}
    store.record_vote(row.id, Vote(vote, 5.0, NOW, True, 0, False), details=details)


def test_the_frame_log_and_sureals_votes_are_exported(folder, tmp_path):
    from analysis import read_votes
    from analysis.surealfile import read_sureal

    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for observer in ("P01", "P02"):
            for row in store.rows(observer):
                watched(store, row, 7, refresh_hz=50.0, device_pixel_ratio=1, full_screen=True)
    out = tmp_path / "votes"
    export_votes(folder, out)
    first = {path.name: path.read_bytes() for path in out.iterdir()}
    export_votes(folder, out)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == first

    lines = [json.loads(line) for line in gzip.decompress(first["frames.jsonl.gz"]).splitlines()]
    assert len(lines) == 2 * 5 * 2
    assert lines[0]["frames"] == [[0, 0.0], [1, 40.0]]
    assert {line["refresh_hz"] for line in lines} == {50.0}
    shown = table(out / "presentations.csv")
    assert shown[0]["longest_interval_ms"] == "41.5"
    assert (shown[0]["full_screen"], shown[-1]["full_screen"]) == ("true", "")
    votes = read_votes(out / "votes.csv")
    again = read_sureal(out / "sureal.json")
    scored = votes[votes["kind"] == "test"]
    assert len(again) == len(scored) == 8
    key = ["observer", "stimulus"]
    merged = scored.merge(again, on=key, suffixes=("", "_sureal"))
    assert len(merged) == 8
    assert (merged["vote"] == merged["vote_sureal"]).all()
    package = json.loads(first["datapackage.json"])
    described = {entry["path"] for entry in package["resources"] + package["files"]}
    assert described == set(first) - {"datapackage.json"}


def test_status_flags_what_may_spoil_a_sitting_and_tells_no_score(folder):
    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for row in store.rows("P01"):
            watched(store, row, 7, refresh_hz=60.0, device_pixel_ratio=1.25, full_screen=False)
        for row in store.rows("P02"):
            watched(store, row, 7, refresh_hz=50.02, device_pixel_ratio=1, full_screen=True)
        store.log("interrupted", presentation=store.rows("P02")[0].id, showing=1)
    first, second, *_ = status(folder).observers
    assert first.flags == (
        "60 Hz is no multiple of 25 (5)",
        "not full screen (5)",
        "zoomed, pixel ratio 1.25 (5)",
    )
    assert second.flags == ("interrupted (1)",)
    assert "7" not in str(status(folder)).replace("P07", "")
    assert str(status(folder)).startswith("2 of 4 observers are done")


def test_the_same_grade_many_times_is_flagged(tmp_path):
    folder = tmp_path / "stimuli"
    write_test(folder, repetitions=3)
    plan_panel(folder, "anna", seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        for row in store.rows("anna"):
            store.record_vote(row.id, Vote(4, None, NOW, True, None, False))
    (anna,) = status(folder).observers
    assert anna.flags == ("the same grade 10 times or more in succession",)


def test_votes_that_were_altered_are_not_exported(folder, tmp_path):
    plan_panel(folder, seed=5)
    with open_store(folder, read_manifest(folder)) as store:
        store.record_vote(store.rows("P01")[0].id, Vote(4, None, NOW, True, None, False))
    export_votes(folder, tmp_path / "votes")
    db = sqlite3.connect(folder / STORE)
    db.execute("DROP TRIGGER votes_no_UPDATE")
    db.execute("UPDATE votes SET vote = 9")
    db.commit()
    db.close()
    with pytest.raises(DamagedError, match="not those in the log"):
        export_votes(folder, tmp_path / "votes")
