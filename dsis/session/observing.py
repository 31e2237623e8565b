"""One observer doing the test: what comes next, what was shown, which votes are taken.

All state that matters is in the store; a page or a player may die at any moment and ask again. A
player shows what `presentation` describes, between `start` and `vote`.
"""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Lock
from typing import Annotated, Any

from pydantic import Field

from dsis.errors import InputError
from dsis.manifest import Manifest
from dsis.model import Model, structure
from dsis.session import events
from dsis.session.cliplog import ClipLog
from dsis.session.clips import PlayerClip, checked_clip
from dsis.session.forms import ConsentForm, DisplayForm, ObserverRecord
from dsis.session.personal import write_record
from dsis.session.plan import repeat
from dsis.session.player import Player
from dsis.session.setup import current_setup
from dsis.session.steps import GREY, Step, grade_words, steps
from dsis.session.store import Row, Store, Vote


class VoteForm(Model):
    """A vote as the page sends it; `showing` is what `start` returned.

    `clips` are the page's own logs; none where another player showed the clips.
    """

    showing: int
    vote: int
    reaction_ms: Annotated[float, Field(ge=0)]
    clips: tuple[ClipLog, ...] = ()


class Observation:
    """The test of one observer, over a store that has the observer's plan.

    Parameters
    ----------
    store, manifest, folder, observer
        The test.
    say
        Tells the experimenter what happens.
    player
        Shows the clips; None: the page does.
    clips_kept
        How many clips a page may keep in memory.
    clock_s
        A clock that never goes back.
    """

    def __init__(
        self,
        store: Store,
        manifest: Manifest,
        folder: Path,
        observer: str,
        *,
        say: Callable[[str], object],
        player: Player | None = None,
        clips_kept: int = 2,
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.observer = observer
        self._store, self._manifest, self._folder = store, manifest, folder
        self._say, self._clock_s, self._player = say, clock_s, player
        self._clips_kept = clips_kept
        self._setup = current_setup(store, manifest.session)
        self._clips: dict[str, PlayerClip] = {}
        self._showing: tuple[int, int, float] | None = None  # row, number, start in seconds
        self._shown: tuple[ClipLog, ...] = ()  # by a player of the server's
        self._playing = Lock()  # a page that is reloaded leaves its showing running
        self._display_confirmed = self._filled = False

    def describe(self) -> dict[str, Any]:
        """Return what a page needs to know of the whole test."""
        session, sequence = self._manifest.session, self._manifest.sequence
        viewing, display = self._manifest.viewing, self._setup.display
        rows = self._store.rows(self.observer)
        wanted = viewing.model_dump(mode="json") if viewing is not None else {}
        return {
            "title": self._manifest.title,
            "observer": self.observer,
            "scale": session.scale,
            "labels": session.labels,
            "words": self._setup.grade_words or grade_words(session),
            "times_shown": 2 if session.variant == "II" else 1,
            "vote_s": session.vote_s,
            "grey": GREY,
            "width": sequence.width,
            "height": sequence.height,
            "fps": sequence.fps,
            "training": any(r.presentation.kind == "training" and r.vote is None for r in rows),
            "begun": any(r.vote is not None for r in rows),
            "player": "page" if self._player is None else "program",
            "clips_kept": self._clips_kept,
            "missing": self.missing(),
            "consent": self._setup.consent,
            "consent_sha256": self._setup.consent_sha256,
            "instructions": self._setup.instructions,
            "display": {} if display is None else display.model_dump(mode="json"),
            "viewing": wanted,
        }

    def missing(self) -> list[str]:
        """Return the forms that are still to be filled, in their order."""
        if self._filled:
            return []
        filled = {name: self._facts(name) for name in ("observer_record", "consent")}
        agreed = [fact["sha256"] for fact in filled["consent"]]
        wanted = {
            "observer": not filled["observer_record"],
            "consent": bool(self._setup.consent) and self._setup.consent_sha256 not in agreed,
            "display": not self._display_confirmed,
        }
        left = [name for name, missing in wanted.items() if missing]
        self._filled = not left
        return left

    def fill(self, name: str, values: Mapping[str, Any]) -> list[str]:
        """Keep a form (`observer`, `consent`, `display`) and return what is still missing.

        Personal data goes into its own file and nowhere else.

        Raises
        ------
        InputError
            No such form, or a fault in it.
        """
        if name == "observer":
            record = structure(ObserverRecord, values, name)
            write_record(self._folder, self.observer, record)
            self._store.log("observer_record", observer=self.observer)
            for remark in record.remarks():
                self._say(f"{self.observer}: {remark}")
        elif name == "consent":
            given = structure(ConsentForm, values, name)
            if given.sha256 != self._setup.consent_sha256:
                raise InputError.of(name, "sha256", "is of another text: reload the page")
            self._store.log("consent", observer=self.observer, sha256=given.sha256)
        elif name == "display":
            form = structure(DisplayForm, values, name)
            facts = form.model_dump(mode="json")
            if self._player is not None:
                facts["player"] = dict(self._player.describe())
            self._store.log("display", observer=self.observer, **facts)
            self._display_confirmed = True
            if not (form.steps_seen and form.pixels_even):
                self._say(f"{self.observer}: the display check failed; {form.note or 'no note'}")
        else:
            raise InputError.of("form", "", f"{name!r} is none")
        return self.missing()

    def current(self) -> Row | None:
        """Return the presentation that is to be voted on next; None: the test is done."""
        return next((row for row in self._store.rows(self.observer) if row.vote is None), None)

    def presentation(self, row: Row) -> dict[str, Any]:
        """Return what to show for `row`; its clips have been read and are the manifest's.

        Raises
        ------
        DamagedError
            A clip is not what the manifest says.
        """
        p = row.presentation
        clips = self._pair(row)
        return {
            "id": row.id,
            "kind": p.kind,
            "session": p.session,
            "steps": [
                {"show": s.show, "seconds": s.seconds, "label": s.label, "frames": self._frames(s)}
                for s in steps(self._manifest.session)
            ],
            "sha256": {show: clip.frame_sha256 for show, clip in clips.items()},
        }

    def frame(self, row_id: int, show: str, number: int) -> bytes:
        """Return a frame of a clip of the current presentation."""
        row = self._current_is(row_id)
        stimulus = {"reference": row.presentation.reference, "test": row.presentation.stimulus}
        clip = self._clips.get(stimulus.get(show, ""))
        if clip is None or not 0 <= number < len(clip.frame_sha256):
            raise InputError.of("frame", "", f"{show} {number} is not part of what is shown now")
        return clip.frame(number)

    def start(self, row_id: int, display: Mapping[str, Any]) -> int:
        """Log that a presentation begins and return the number of this showing, from 1.

        An earlier showing that ended without a vote was interrupted; its page is out of date.
        """
        row = self._current_is(row_id)
        if self.missing():
            raise InputError.of("presentation", "", f"first come: {', '.join(self.missing())}")
        if self._player is not None:  # the page is on another display than the clips
            display = {"page": dict(display)}
        before = len([e for e in self._store.events("started") if e["presentation"] == row.id])
        with self._store.transaction():
            if before:
                self._store.log("interrupted", presentation=row.id, showing=before)
            self._store.log("started", presentation=row.id, showing=before + 1, display=display)
        self._showing, self._shown = (row.id, before + 1, self._clock_s()), ()
        return before + 1

    def show(self, row_id: int, showing: int) -> None:
        """Show a presentation that has been started, where the page is not the player.

        Raises
        ------
        DamagedError
            The player does not answer.
        """
        row = self._current_is(row_id)
        if self._player is None or self._showing is None or self._showing[:2] != (row.id, showing):
            raise InputError.of("presentation", "", f"{row.id} was not started in this window")
        with self._playing:
            if self._showing[:2] != (row.id, showing):  # a reloaded page has started it again
                return
            shown = self._player.show(steps(self._manifest.session), self._pair(row))
            if self._showing[:2] == (row.id, showing):
                self._shown = shown

    def vote(self, row_id: int, form: Mapping[str, Any]) -> int | None:
        """Store a vote and return the vote that stands; the same vote twice is one vote.

        Raises
        ------
        InputError
            The presentation was not shown to its end, or has another vote, or the form is wrong.
        """
        vote = structure(VoteForm, form, "vote")
        rows = self._store.rows(self.observer)
        earlier = next((r.vote for r in rows if r.id == row_id and r.vote is not None), None)
        if earlier is not None:
            if earlier.vote != vote.vote:
                raise InputError.of("vote", "", f"is there already: {earlier.vote}")
            return earlier.vote
        row = self._current_is(row_id)
        logs = self._check_shown(row, vote)
        dropped = sum(map(self._dropped, logs, self._clip_steps()))
        plan = [r.presentation for r in rows]
        again = repeat(plan, row.presentation, self._manifest) if dropped else ()
        stands = self._store.record_vote(
            row.id,
            Vote(vote.vote, vote.reaction_ms, events.now(), dropped == 0, dropped, False),
            details={
                "showing": vote.showing,
                "clips": [log.model_dump(mode="json") for log in logs],
            },
            again=again,
        )
        if dropped:
            then = "it is repeated at the end" if again else "it is not repeated"
            self._say(f"presentation {row.presentation.place}: {dropped} frames dropped; {then}")
        return stands.vote

    def _current_is(self, row_id: int) -> Row:
        row = self.current()
        if row is None or row.id != row_id:
            raise InputError.of("presentation", "", f"{row_id} is not the one shown now")
        return row

    def _check_shown(self, row: Row, vote: VoteForm) -> tuple[ClipLog, ...]:
        """Return what was shown; refuse a vote on what was not shown from beginning to end."""
        if self._showing is None or self._showing[:2] != (row.id, vote.showing):
            fact = f"{row.id} was not shown in this window, or again since: reload the page"
            raise InputError.of("presentation", "", fact)
        logs = vote.clips if self._player is None else self._shown
        if self._player is not None and vote.clips:
            raise InputError.of("vote", "clips", "were shown by another program")
        if self._player is None and any(log.dropped is not None or log.counters for log in logs):
            raise InputError.of("vote", "clips", "must be logs of frames, without counters")
        if [log.show for log in logs] != [step.show for step in self._clip_steps()]:
            raise InputError.of("vote", "clips", "are not those of the presentation")
        # A player that is on time may end every step up to one frame early.
        whole, frame_s = steps(self._manifest.session), 1.0 / self._manifest.sequence.fps
        least_s = sum(max(0.0, step.seconds - frame_s) for step in whole)
        if self._clock_s() - self._showing[2] < least_s:
            raise InputError.of("vote", "", "comes before the clip has ended")
        return logs

    def _dropped(self, log: ClipLog, step: Step) -> int:
        """Return the frames of a clip that were not painted, or stood through after the last."""
        if log.dropped is not None:
            return log.dropped
        painted = [number for number, _ in log.frames]
        if painted != sorted(set(painted)) or (painted and painted[-1] >= self._frames(step)):
            raise InputError.of("vote", "clips", f"{log.show}: frames are not in order")
        missing = self._frames(step) - len(painted)
        # Between two frames that were painted a gap of d missing ones lasts less than d + 2 frames:
        # whatever stays longer is the last one, frozen when the grey should have come.
        stayed = int((log.longest_interval_ms or 0.0) * self._manifest.sequence.fps / 1000)
        return max(missing, stayed - 1)

    def _clip_steps(self) -> list[Step]:
        return [step for step in steps(self._manifest.session) if step.show != "grey"]

    def _facts(self, event: str) -> list[dict[str, Any]]:
        return [f for f in self._store.events(event) if f["observer"] == self.observer]

    def _pair(self, row: Row) -> dict[str, PlayerClip]:
        p = row.presentation
        return {"reference": self._clip(p.reference), "test": self._clip(p.stimulus)}

    def _frames(self, step: Step) -> int:
        if step.show == "grey":
            return 0
        return max(1, round(step.seconds * self._manifest.sequence.fps))

    def _clip(self, stimulus: str) -> PlayerClip:
        if stimulus not in self._clips:
            clip = self._manifest.clip(stimulus)
            self._clips[stimulus] = checked_clip(self._manifest, self._folder, clip)
        return self._clips[stimulus]
