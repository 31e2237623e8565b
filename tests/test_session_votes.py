"""Promise: a vote is taken once, on what was shown whole; a showing with drops is repeated."""

import pytest

from dsis.session import status
from dsis.session.store import read_store
from sitting import PAIR_S, Sitting, write_test


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "stimuli"


@pytest.fixture
def sitting(folder):
    with Sitting(folder, write_test(folder)) as found:
        yield found


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


def test_a_page_cannot_state_its_own_count_of_dropped_frames(sitting):
    presentation = sitting.next()
    form = sitting.form(presentation, sitting.watch(presentation), 7)
    form["clips"][0] = {"show": "reference", "dropped": 0}
    assert "without counters" in sitting.vote(presentation, form).json()["error"]
