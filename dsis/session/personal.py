"""Personal data of observers: a table in a file of its own, `session/personal.sqlite`.

The votes know pseudonyms only; this file can be kept, or destroyed, apart from them. Unlike the
votes, its rows may be replaced and erased: what is deleted is overwritten.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from dsis.errors import InputError
from dsis.session.events import now
from dsis.session.forms import ObserverRecord

PERSONAL = Path("session") / "personal.sqlite"

_TABLE = """CREATE TABLE IF NOT EXISTS people (
    observer TEXT PRIMARY KEY,
    recorded_at TEXT NOT NULL,
    record TEXT NOT NULL
) STRICT"""


def write_record(folder: Path, observer: str, record: ObserverRecord) -> None:
    """Keep what is known of an observer; an earlier record is replaced."""
    with _opened(folder) as db:
        text = record.model_dump_json()
        db.execute("INSERT OR REPLACE INTO people VALUES (?, ?, ?)", (observer, now(), text))


def read_records(folder: Path) -> dict[str, tuple[str, ObserverRecord]]:
    """Return (recorded at, record) of every observer by pseudonym; empty where there is no file."""
    if not (folder / PERSONAL).is_file():
        return {}
    with _opened(folder) as db:
        rows = db.execute("SELECT observer, recorded_at, record FROM people ORDER BY observer")
        return {name: (at, ObserverRecord.model_validate_json(text)) for name, at, text in rows}


def forget(folder: Path, observer: str) -> None:
    """Erase the personal data of an observer; votes under the pseudonym stay.

    Raises
    ------
    InputError
        There is none.
    """
    if observer not in read_records(folder):
        raise InputError.of(folder / PERSONAL, "observer", f"holds nothing about {observer!r}")
    with _opened(folder) as db:
        db.execute("DELETE FROM people WHERE observer = ?", (observer,))


@contextmanager
def _opened(folder: Path) -> Iterator[sqlite3.Connection]:
    path = folder / PERSONAL
    path.parent.mkdir(exist_ok=True)
    db = sqlite3.connect(path, timeout=30.0)
    try:
        db.execute("PRAGMA secure_delete = ON")
        db.execute("PRAGMA synchronous = FULL")
        with db:
            db.execute(_TABLE)
            yield db
    except sqlite3.Error as error:
        raise InputError.of(path, "", f"cannot be used: {error}") from None
    finally:
        db.close()
