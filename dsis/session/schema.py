"""Tables of the store. Append-only: rows cannot be changed, removed or replaced.

`session` counts viewing sessions, `place` the presentations of an observer, both from 1; `seed` is
the plan's. Times are ISO 8601 with offset. Personal data has no place in these tables.
"""

SCHEMA_VERSION = 1

_TABLES = (
    """CREATE TABLE test (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        manifest_sha256 TEXT NOT NULL,
        worst INTEGER NOT NULL,
        best INTEGER NOT NULL,
        created_at TEXT NOT NULL,
        dsis_version TEXT NOT NULL
    ) STRICT""",
    """CREATE TABLE observers (
        observer TEXT PRIMARY KEY CHECK (observer <> ''),
        simulated INTEGER NOT NULL CHECK (simulated IN (0, 1)),
        seed INTEGER NOT NULL,
        created_at TEXT NOT NULL
    ) STRICT""",
    """CREATE TABLE presentations (
        id INTEGER PRIMARY KEY,
        observer TEXT NOT NULL REFERENCES observers (observer),
        place INTEGER NOT NULL CHECK (place >= 1),
        session INTEGER NOT NULL CHECK (session >= 1),
        kind TEXT NOT NULL CHECK (kind IN ('training', 'dummy', 'test', 'reference')),
        stimulus TEXT NOT NULL,
        reference TEXT NOT NULL,
        repetition INTEGER NOT NULL CHECK (repetition >= 1),
        attempt INTEGER NOT NULL CHECK (attempt >= 1),
        seed INTEGER NOT NULL,
        UNIQUE (observer, place),
        UNIQUE (observer, kind, stimulus, repetition, attempt)
    ) STRICT""",
    """CREATE TABLE votes (
        presentation INTEGER PRIMARY KEY REFERENCES presentations (id),
        vote INTEGER,
        reaction_ms REAL CHECK (reaction_ms >= 0),
        voted_at TEXT NOT NULL,
        valid INTEGER NOT NULL CHECK (valid IN (0, 1)),
        dropped_frames INTEGER CHECK (dropped_frames >= 0),
        simulated INTEGER NOT NULL CHECK (simulated IN (0, 1))
    ) STRICT""",
    """CREATE TABLE events (
        id INTEGER PRIMARY KEY,
        previous TEXT NOT NULL,
        payload TEXT NOT NULL,
        hash TEXT NOT NULL UNIQUE
    ) STRICT""",
)
_KEYS = {
    "test": ("id",),
    "observers": ("observer",),
    "presentations": ("id", "observer, place", "observer, kind, stimulus, repetition, attempt"),
    "votes": ("presentation",),
    "events": ("id", "hash"),
}


def _append_only(table: str, keys: tuple[str, ...]) -> tuple[str, ...]:
    """Return triggers that forbid UPDATE, DELETE and INSERT OR REPLACE.

    The last removes a row without asking the trigger on DELETE.
    """
    taken = " OR ".join(
        f"(NEW.{key.replace(', ', ', NEW.')}) IN (SELECT {key} FROM {table})"  # noqa: S608  constants
        for key in keys
    )
    guards = (("UPDATE", ""), ("DELETE", ""), ("INSERT", f"WHEN {taken} "))
    return tuple(
        f"CREATE TRIGGER {table}_no_{event} BEFORE {event} ON {table} {when}"
        f"BEGIN SELECT RAISE(ABORT, '{table} is append-only'); END"
        for event, when in guards
    )


_ON_SCALE = """CREATE TRIGGER votes_on_scale BEFORE INSERT ON votes
    WHEN NEW.vote NOT BETWEEN (SELECT worst FROM test) AND (SELECT best FROM test)
    BEGIN SELECT RAISE(ABORT, 'vote is outside the scale'); END"""
_BY_OBSERVER = """CREATE TRIGGER votes_by_observer BEFORE INSERT ON votes
    WHEN NEW.simulated <> (SELECT simulated FROM observers JOIN presentations USING (observer)
                           WHERE id = NEW.presentation)
    BEGIN SELECT RAISE(ABORT, 'a robot is not a person'); END"""

_TRIGGERS = tuple(trigger for table, keys in _KEYS.items() for trigger in _append_only(table, keys))

SCHEMA = (
    *_TABLES,
    *_TRIGGERS,
    _ON_SCALE,
    _BY_OBSERVER,
    f"PRAGMA user_version = {SCHEMA_VERSION}",
)
