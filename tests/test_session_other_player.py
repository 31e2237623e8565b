"""Promise: a program that shows the clips instead of the page counts its own frames."""

import threading
import time

import pytest

from dsis.session.cliplog import ClipLog
from dsis.session.store import read_store
from sitting import Sitting, write_test


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "stimuli"


@pytest.fixture
def sitting(folder):
    with Sitting(folder, write_test(folder)) as found:
        yield found


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
