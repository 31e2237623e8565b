"""One observer doing the test: what comes next, what was shown, which votes are taken.

All state that matters is in the store; a page or a player may die at any moment and ask again. A
player shows what `presentation` describes, between `start` and `vote`.
"""

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from dsis.errors import InputError
from dsis.manifest import Manifest
from dsis.model import Model, structure
from dsis.session import events
from dsis.session.clips import PlayerClip, checked_clip
from dsis.session.plan import repeat
from dsis.session.steps import GREY, Step, steps
from dsis.session.store import Row, Store, Vote


class ClipLog(Model):
    """What a player saw itself paint of one clip.

    Attributes
    ----------
    show
        Which clip of the pair.
    frames
        (frame, time in ms after the first) of every frame that was painted, ascending.
    longest_interval_ms
        Longest time that one frame stayed.
    hidden
        The page was not on the screen for some of the time.
    """

    show: Literal["reference", "test"]
    frames: tuple[tuple[Annotated[int, Field(ge=0)], float], ...]
    longest_interval_ms: Annotated[float, Field(ge=0)]
    hidden: bool


class VoteForm(Model):
    """A vote as a player sends it; `showing` is what `start` returned."""

    showing: int
    vote: int
    reaction_ms: Annotated[float, Field(ge=0)]
    clips: tuple[ClipLog, ...]


class Observation:
    """The test of one observer, over a store that has the observer's plan."""

    def __init__(
        self,
        store: Store,
        manifest: Manifest,
        folder: Path,
        observer: str,
        *,
        say: Callable[[str], object],
        clock_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self.observer = observer
        self._store, self._manifest, self._folder = store, manifest, folder
        self._say, self._clock_s = say, clock_s
        self._clips: dict[str, PlayerClip] = {}
        self._showing: tuple[int, int, float] | None = None  # row, number, start in seconds

    def describe(self) -> dict[str, Any]:
        """Return what a player needs to know of the whole test."""
        session, sequence = self._manifest.session, self._manifest.sequence
        rows = self._store.rows(self.observer)
        return {
            "title": self._manifest.title,
            "observer": self.observer,
            "scale": session.scale,
            "labels": session.labels,
            "times_shown": 2 if session.variant == "II" else 1,
            "vote_s": session.vote_s,
            "grey": GREY,
            "width": sequence.width,
            "height": sequence.height,
            "fps": sequence.fps,
            "training": any(r.presentation.kind == "training" and r.vote is None for r in rows),
            "begun": any(r.vote is not None for r in rows),
        }

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
        clips = {
            "reference": self._clip(p.reference),
            "test": self._clip(p.stimulus),
        }
        return {
            "id": row.id,
            "kind": p.kind,
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
        before = len([e for e in self._store.events("started") if e["presentation"] == row.id])
        with self._store.transaction():
            if before:
                self._store.log("interrupted", presentation=row.id, showing=before)
            self._store.log("started", presentation=row.id, showing=before + 1, display=display)
        self._showing = (row.id, before + 1, self._clock_s())
        return before + 1

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
        self._check_shown(row, vote)
        dropped = self._dropped(vote)
        plan = [r.presentation for r in rows]
        again = repeat(plan, row.presentation, self._manifest) if dropped else ()
        stands = self._store.record_vote(
            row.id,
            Vote(vote.vote, vote.reaction_ms, events.now(), dropped == 0, dropped, False),
            details={
                "showing": vote.showing,
                "clips": [clip.model_dump(mode="json") for clip in vote.clips],
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

    def _check_shown(self, row: Row, vote: VoteForm) -> None:
        """Refuse a vote on what this player has not shown from beginning to end."""
        if self._showing is None or self._showing[:2] != (row.id, vote.showing):
            fact = f"{row.id} was not shown in this window, or again since: reload the page"
            raise InputError.of("presentation", "", fact)
        whole, frame_s = steps(self._manifest.session), 1.0 / self._manifest.sequence.fps
        if [clip.show for clip in vote.clips] != [s.show for s in whole if s.show != "grey"]:
            raise InputError.of("vote", "clips", "are not those of the presentation")
        # A player that is on time may end every step up to one frame early.
        least_s = sum(max(0.0, step.seconds - frame_s) for step in whole)
        if self._clock_s() - self._showing[2] < least_s:
            raise InputError.of("vote", "", "comes before the clip has ended")

    def _dropped(self, vote: VoteForm) -> int:
        """Return the frames of all clips that were not painted."""
        shown = [step for step in steps(self._manifest.session) if step.show != "grey"]
        dropped = 0
        for step, clip in zip(shown, vote.clips, strict=True):
            painted = [number for number, _ in clip.frames]
            if painted != sorted(set(painted)) or (painted and painted[-1] >= self._frames(step)):
                raise InputError.of("vote", "clips", f"{clip.show}: frames are not in order")
            dropped += self._frames(step) - len(painted)
        return dropped

    def _frames(self, step: Step) -> int:
        if step.show == "grey":
            return 0
        return max(1, round(step.seconds * self._manifest.sequence.fps))

    def _clip(self, stimulus: str) -> PlayerClip:
        if stimulus not in self._clips:
            clip = self._manifest.clip(stimulus)
            self._clips[stimulus] = checked_clip(self._manifest, self._folder, clip)
        return self._clips[stimulus]
