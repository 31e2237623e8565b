"""How far the observers of a test are; never how they vote."""

from dataclasses import dataclass
from pathlib import Path

from dsis.manifest import read_manifest
from dsis.session.plan import SCORED
from dsis.session.store import STORE, Row, read_store


@dataclass(frozen=True)
class Progress:
    """One observer: presentations planned, voted on, and of these not valid; none below zero.

    `lost` counts stimuli without a valid vote that will not be shown again.
    """

    observer: str
    simulated: bool
    planned: int
    done: int
    invalid: int
    lost: int


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
            lines.append(f"{'observer':<{width}}  done  planned  invalid  lost")
            lines += [
                f"{p.observer:<{width}}  {p.done:>4}  {p.planned:>7}  {p.invalid:>7}  {p.lost:>4}"
                + ("  SIMULATED" if p.simulated else "")
                for p in self.observers
            ]
        return "\n".join(lines)


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
        observers = store.observers()
        progress = [_progress(o.observer, o.simulated, store.rows(o.observer)) for o in observers]
    return Status(tuple(progress), asked)


def _progress(observer: str, simulated: bool, rows: list[Row]) -> Progress:
    done = [row for row in rows if row.vote is not None]
    invalid = [row for row in done if row.vote is not None and not row.vote.valid]
    open_or_valid = {_showing(row) for row in rows if row not in invalid}
    lost = {_showing(row) for row in invalid if row.presentation.kind in SCORED} - open_or_valid
    return Progress(observer, simulated, len(rows), len(done), len(invalid), len(lost))


def _showing(row: Row) -> tuple[str, str, int]:
    return row.presentation.kind, row.presentation.stimulus, row.presentation.repetition
