"""The store of a session: who was to see what, and every vote, in `session/votes.sqlite`.

SQLite with a write-ahead log, synced at every commit: what `record_vote` has returned from survives
the death of the process and of the machine. Nothing is ever changed or removed: tables are
append-only, a presentation with dropped frames is repeated as a new row, and every step is an event
in a log that cannot be altered unseen. The file belongs to one manifest.
"""

import hashlib
import re
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, final

from dsis import __version__
from dsis.errors import DamagedError, InputError
from dsis.manifest import MANIFEST, Manifest
from dsis.session import events
from dsis.session.plan import Presentation
from dsis.session.schema import SCHEMA, SCHEMA_VERSION

STORE = Path("session") / "votes.sqlite"
OBSERVER = re.compile(r"\w[\w.-]{0,63}")
SEED_MAX = 2**63 - 1
_OLDEST_SQLITE = (3, 37)  # STRICT tables
_WAIT_S = 30.0  # for another process that writes


@dataclass(frozen=True)
class Vote:
    """A vote as it is stored.

    Attributes
    ----------
    vote
        A grade of the scale; None: none was given in time.
    reaction_ms
        From the end of the clip to the vote; None: not measured.
    voted_at
        ISO 8601 with offset.
    valid
        False: the clips had dropped frames.
    dropped_frames
        Frames of the presentation that never were on the screen; None: nothing was shown.
    simulated
        The vote of a robot.
    """

    vote: int | None
    reaction_ms: float | None
    voted_at: str
    valid: bool
    dropped_frames: int | None
    simulated: bool


@dataclass(frozen=True)
class Row:
    """A presentation of the plan of an observer, with the vote on it or None."""

    id: int
    observer: str
    presentation: Presentation
    vote: Vote | None


@dataclass(frozen=True)
class Observer:
    """An observer, by pseudonym; `seed` is that of the plan."""

    observer: str
    simulated: bool
    seed: int
    created_at: str


@final
class Store:
    """One open store; a context manager. Made by `open_store` and `read_store`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._db = connection

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._db.close()

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """All that is written inside is there, or none of it; may be nested."""
        if self._db.in_transaction:
            yield
            return
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._db.execute("ROLLBACK")
            raise
        self._db.execute("COMMIT")

    def add_observer(
        self,
        observer: str,
        plan: Sequence[Presentation],
        *,
        simulated: bool,
        created_at: str | None = None,
    ) -> None:
        """Store an observer with a plan, in one transaction.

        Raises
        ------
        InputError
            The observer is there already, or the name or the seed cannot be one.
        """
        seed = plan[0].seed
        if not OBSERVER.fullmatch(observer):
            fact = f"is {observer!r}, must be up to 64 letters, digits, '_', '-' and '.'"
            raise InputError.of("observer", "", fact)
        if not 0 <= seed <= SEED_MAX:
            raise InputError.of("seed", "", f"is {seed}, must be from 0 to {SEED_MAX}")
        with self.transaction():
            if self.observer(observer) is not None:
                fact = f"{observer!r} is there already: take another id, or resume"
                raise InputError.of(self.path, "observer", fact)
            self._db.execute(
                "INSERT INTO observers VALUES (?, ?, ?, ?)",
                (observer, simulated, seed, created_at or events.now()),
            )
            self.log("observer_added", observer=observer, simulated=simulated, seed=seed)
            self._append(observer, plan)

    def record_vote(
        self,
        row: int,
        vote: Vote,
        *,
        details: Mapping[str, Any] | None = None,
        again: Sequence[Presentation] = (),
    ) -> Vote:
        """Store the vote on the presentation with id `row` and return the vote that stands there.

        A presentation has one vote, the first; once this returns, it is on the disk.

        Parameters
        ----------
        row, vote
            The vote; `vote.simulated` must be what the observer is.
        details
            For the log of events: what was shown when.
        again
            Presentations to append to the observer's plan, because this one is not valid.

        Raises
        ------
        InputError
            No such presentation, or a vote outside the scale.
        """
        with self.transaction():
            found = next(iter(self._rows("p.id = ?", row)), None)
            if found is None:
                raise InputError.of(self.path, "presentation", f"{row} is in no plan")
            if found.vote is not None:
                return found.vote
            worst, best = self.scale
            if vote.vote is not None and not worst <= vote.vote <= best:
                fact = f"is {vote.vote}, must be a whole number from {worst} to {best}"
                raise InputError.of("vote", "", fact)
            self._db.execute(
                "INSERT INTO votes VALUES (?, ?, ?, ?, ?, ?, ?)",
                (
                    row,
                    vote.vote,
                    vote.reaction_ms,
                    vote.voted_at,
                    vote.valid,
                    vote.dropped_frames,
                    vote.simulated,
                ),
            )
            self.log("voted", presentation=row, vote=vote.vote, **(details or {}))
            if again:
                self._append(found.observer, again)
        return vote

    def log(self, event: str, **facts: Any) -> None:
        """Append an event: its name, and facts that JSON can hold."""
        with self.transaction():
            events.append(self._db, self.manifest_sha256, event, **facts)

    def rows(self, observer: str | None = None) -> list[Row]:
        """Return the presentations of one observer, or of all, by observer and place."""
        if observer is None:
            return self._rows("TRUE")
        return self._rows("p.observer = ?", observer)

    def observers(self) -> list[Observer]:
        """Return all observers by name."""
        found = self._db.execute(
            "SELECT observer, simulated, seed, created_at FROM observers ORDER BY observer"
        )
        return [Observer(name, bool(sim), seed, at) for name, sim, seed, at in found]

    def observer(self, name: str) -> Observer | None:
        """Return the observer of that name, or None."""
        return next((known for known in self.observers() if known.observer == name), None)

    def events(self, event: str) -> list[dict[str, Any]]:
        """Return the facts of all events of that name, oldest first."""
        return events.entries(self._db, event)

    @property
    def manifest_sha256(self) -> str:
        """SHA-256 of the manifest that the votes are about."""
        return str(self._db.execute("SELECT manifest_sha256 FROM test").fetchone()[0])

    @property
    def scale(self) -> tuple[int, int]:
        """Worst and best grade."""
        worst, best = self._db.execute("SELECT worst, best FROM test").fetchone()
        return int(worst), int(best)

    def check(self) -> None:
        """Raise `DamagedError` unless file, references, log and votes are sound."""
        found = [str(row[0]) for row in self._db.execute("PRAGMA integrity_check")]
        faults = [fault for fault in found if fault != "ok"]
        for table, *_ in self._db.execute("PRAGMA foreign_key_check"):
            faults.append(f"a row of {table} refers to nothing")
        faults += events.broken_links(self._db, self.manifest_sha256)
        logged = [(facts.get("presentation"), facts.get("vote")) for facts in self.events("voted")]
        stored = self._db.execute("SELECT presentation, vote FROM votes").fetchall()
        if sorted(map(repr, logged)) != sorted(map(repr, stored)):
            faults.append("the votes are not those in the log of events")
        if faults:
            raise DamagedError("\n".join(f"{self.path}: {fault}" for fault in faults))

    def _append(self, observer: str, plan: Sequence[Presentation]) -> None:
        self._db.executemany(
            "INSERT INTO presentations (observer, place, session, kind, stimulus, reference, "
            "repetition, attempt, seed) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                (
                    observer,
                    p.place,
                    p.session,
                    p.kind,
                    p.stimulus,
                    p.reference,
                    p.repetition,
                    p.attempt,
                    p.seed,
                )
                for p in plan
            ],
        )
        self.log("planned", observer=observer, places=[plan[0].place, plan[-1].place])

    def _rows(self, where: str, *values: object) -> list[Row]:
        found = self._db.execute(
            "SELECT p.id, p.observer, p.place, p.kind, p.stimulus, p.reference, p.repetition, "  # noqa: S608  `where` is one of the three texts in this class
            "p.attempt, p.seed, p.session, v.presentation, v.vote, v.reaction_ms, v.voted_at, "
            "v.valid, v.dropped_frames, v.simulated "
            "FROM presentations p LEFT JOIN votes v ON v.presentation = p.id "
            f"WHERE {where} ORDER BY p.observer, p.place",
            values,
        )
        return [
            Row(r[0], r[1], Presentation(*r[2:10]), None if r[10] is None else _vote(r[11:]))
            for r in found
        ]


def open_store(folder: Path, manifest: Manifest) -> Store:
    """Open the store of a stimuli folder to write, made where there is none.

    Raises
    ------
    InputError
        It holds votes on another manifest, or cannot be opened.
    """
    if sqlite3.sqlite_version_info < _OLDEST_SQLITE:
        fact = f"is {sqlite3.sqlite_version}, must be 3.37 or newer"
        raise InputError.of("Python's SQLite", "", fact)
    path = folder / STORE
    with _explained(path):
        path.parent.mkdir(exist_ok=True)
        # One thread at a time uses it; that need not be the one that opened it.
        db = sqlite3.connect(path, timeout=_WAIT_S, isolation_level=None, check_same_thread=False)
    store = Store(path, db)
    with _explained(path, store):
        if db.execute("PRAGMA journal_mode = WAL").fetchone() != ("wal",):
            raise InputError.of(path, "", "is on a disk that allows no write-ahead log")
        db.execute("PRAGMA synchronous = FULL")
        db.execute("PRAGMA foreign_keys = ON")
        with store.transaction():
            if _version(db) == 0:
                for statement in SCHEMA:
                    db.execute(statement)
                facts = (manifest_sha256(folder), *manifest.session.scale, events.now())
                db.execute("INSERT INTO test VALUES (1, ?, ?, ?, ?, ?)", (*facts, __version__))
        _check_owner(store, folder, db)
    return store


def read_store(folder: Path) -> Store:
    """Open the store of a stimuli folder to read; a running session goes on undisturbed.

    Raises
    ------
    InputError
        There is none, it holds votes on another manifest, or cannot be opened.
    """
    path = folder / STORE
    if not path.is_file():
        raise InputError.of(path, "", "is not there: no session has been held on these stimuli")
    with _explained(path):
        uri = f"{path.resolve().as_uri()}?mode=ro"
        db = sqlite3.connect(uri, uri=True, timeout=_WAIT_S, isolation_level=None)
    store = Store(path, db)
    with _explained(path, store):
        db.execute("BEGIN")  # all that is read is of one moment, whatever is written meanwhile
        _check_owner(store, folder, db)
    return store


def voted_people(folder: Path) -> tuple[str, ...]:
    """Return the observers of a stimuli folder who are people; none where there is no store."""
    if not (folder / STORE).is_file():
        return ()
    with read_store(folder) as store:
        return tuple(entry.observer for entry in store.observers() if not entry.simulated)


def manifest_sha256(folder: Path) -> str:
    """Return the SHA-256 of the manifest file in `folder`."""
    return hashlib.sha256((folder / MANIFEST).read_bytes()).hexdigest()


@contextmanager
def _explained(path: Path, store: Store | None = None) -> Iterator[None]:
    """Say in terms of the file why it cannot be opened, and close it."""
    try:
        yield
    except (sqlite3.Error, OSError, InputError) as error:
        if store is not None:
            store.close()
        if isinstance(error, InputError):
            raise
        raise InputError.of(path, "", f"cannot be used: {error}") from None


def _check_owner(store: Store, folder: Path, db: sqlite3.Connection) -> None:
    version = _version(db)
    if version != SCHEMA_VERSION:
        fact = f"has version {version}, this dsis reads version {SCHEMA_VERSION}"
        raise InputError.of(store.path, "", fact)
    if store.manifest_sha256 != manifest_sha256(folder):
        fact = f"holds votes on other stimuli: {folder / MANIFEST} has changed since the session"
        raise InputError.of(store.path, "", f"{fact} began; restore it, or move the votes away")


def _version(db: sqlite3.Connection) -> int:
    return int(db.execute("PRAGMA user_version").fetchone()[0])


def _vote(values: Sequence[Any]) -> Vote:
    vote, reaction_ms, voted_at, valid, dropped_frames, simulated = values
    return Vote(vote, reaction_ms, voted_at, bool(valid), dropped_frames, bool(simulated))
