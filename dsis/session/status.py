"""How far the observers of a test are, and what an experimenter should look at; never the votes."""

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from dsis.manifest import read_manifest
from dsis.session.plan import SCORED
from dsis.session.store import STORE, Row, Store, read_store

UNEVEN = 0.02  # of the refresh rate: what measuring it over a second may be off
SAME_GRADE_RUN = 10


@dataclass(frozen=True)
class Progress:
    """One observer: presentations planned, voted on, and of these not valid; none below zero.

    `lost` counts stimuli without a valid vote that will not be shown again; `dropped_frames` adds
    up all presentations; `flags` are what may spoil a sitting.
    """

    observer: str
    simulated: bool
    planned: int
    done: int
    invalid: int
    lost: int
    dropped_frames: int = 0
    flags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Status:
    """All observers of a test; as text, a table."""

    observers: tuple[Progress, ...]
    asked: int

    def __str__(self) -> str:
        people = sum(not p.simulated and p.done == p.planned for p in self.observers)
        lines = [f"{people} of {self.asked} observers are done"]
        if self.observers:
            width = max(8, *(len(p.observer) for p in self.observers))
            lines.append(f"{'observer':<{width}}  done  planned  invalid  lost  dropped frames")
            lines += [_line(p, width) for p in self.observers]
        return "\n".join(lines)


def _line(p: Progress, width: int) -> str:
    text = f"{p.observer:<{width}}  {p.done:>4}  {p.planned:>7}  {p.invalid:>7}  {p.lost:>4}"
    flags = ["SIMULATED"] if p.simulated else list(p.flags)
    return "  ".join([f"{text}  {p.dropped_frames:>14}", *([", ".join(flags)] if flags else [])])


def status(folder: Path) -> Status:
    """Return how far every observer is.

    Raises
    ------
    InputError
        The folder holds no manifest, or the store belongs to another one.
    """
    manifest = read_manifest(folder)
    asked = manifest.session.observers
    if not (folder / STORE).exists():
        return Status((), asked)
    with read_store(folder) as store:
        rows: dict[str, list[Row]] = {known.observer: [] for known in store.observers()}
        for row in store.rows():
            rows[row.observer].append(row)
        flags = _flags(store, manifest.sequence.fps)
        simulated = {known.observer for known in store.observers() if known.simulated}
    progress = [
        _progress(name, name in simulated, mine, flags.get(name, [])) for name, mine in rows.items()
    ]
    return Status(tuple(progress), asked)


def _progress(observer: str, simulated: bool, rows: list[Row], flags: list[str]) -> Progress:
    done = [row for row in rows if row.vote is not None]
    invalid = [row for row in done if row.vote is not None and not row.vote.valid]
    open_or_valid = {_showing(row) for row in rows if row not in invalid}
    lost = {_showing(row) for row in invalid if row.presentation.kind in SCORED} - open_or_valid
    dropped = sum(row.vote.dropped_frames or 0 for row in done if row.vote is not None)
    if _longest_run([row.vote.vote for row in done if row.vote is not None]) >= SAME_GRADE_RUN:
        flags = [*flags, f"the same grade {SAME_GRADE_RUN} times or more in succession"]
    return Progress(
        observer,
        simulated,
        len(rows),
        len(done),
        len(invalid),
        len(lost),
        dropped,
        tuple(flags),
    )


def _showing(row: Row) -> tuple[str, str, int]:
    return row.presentation.kind, row.presentation.stimulus, row.presentation.repetition


def _longest_run(votes: list[int | None]) -> int:
    longest = run = min(len(votes), 1)
    for before, after in pairwise(votes):
        run = run + 1 if before == after else 1
        longest = max(longest, run)
    return longest


def _flags(store: Store, fps: float) -> dict[str, list[str]]:
    """Return, by observer, what the log says may spoil a sitting, each once with its number."""
    owners = {row.id: row.observer for row in store.rows()}
    counts: dict[str, Counter[str]] = {}
    for event in store.events("started"):
        mine = counts.setdefault(owners[event["presentation"]], Counter())
        mine.update(_of_display(event.get("display", {}), fps))
    for event in store.events("interrupted"):
        counts.setdefault(owners[event["presentation"]], Counter())["interrupted"] += 1
    for event in store.events("display"):
        if not (event["steps_seen"] and event["pixels_even"]):
            counts.setdefault(event["observer"], Counter())["display check failed"] += 1
    return {
        observer: [f"{flag} ({number})" for flag, number in sorted(mine.items())]
        for observer, mine in counts.items()
    }


def _of_display(display: dict[str, Any], fps: float) -> list[str]:
    """Return what is not as it should be on a display; pages of another make say nothing."""
    found = []
    refresh, ratio = display.get("refresh_hz"), display.get("device_pixel_ratio")
    if isinstance(refresh, int | float):
        multiple = refresh / fps
        if multiple < 1 - UNEVEN or abs(multiple - round(multiple)) > UNEVEN * multiple:
            found.append(f"{refresh:.0f} Hz is no multiple of {fps:g}")
    if isinstance(ratio, int | float) and ratio != 1:
        found.append(f"zoomed, pixel ratio {ratio:g}")
    if display.get("full_screen") is False:
        found.append("not full screen")
    return found
