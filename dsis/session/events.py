"""The log of a session: every entry carries the hash of the one before, so none can be altered."""

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any


def now() -> str:
    """Return local time, ISO 8601 with offset, to the millisecond."""
    return datetime.now(UTC).astimezone().isoformat(timespec="milliseconds")


def append(db: sqlite3.Connection, origin: str, event: str, **facts: Any) -> None:
    """Append an event with its time and facts that JSON can hold; inside a transaction.

    `origin` stands for the hash before the first entry: the manifest's.
    """
    last = db.execute("SELECT hash FROM events ORDER BY id DESC LIMIT 1").fetchone()
    previous = last[0] if last else origin
    values = {"event": event, "at": now(), **facts}
    # NaN and Infinity are no JSON: SQLite could never read the log again.
    payload = json.dumps(
        values, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False
    )
    db.execute(
        "INSERT INTO events (previous, payload, hash) VALUES (?, ?, ?)",
        (previous, payload, _link(previous, payload)),
    )


def entries(db: sqlite3.Connection, event: str) -> list[dict[str, Any]]:
    """Return the facts of all events of that name, oldest first."""
    query = "SELECT payload FROM events WHERE json_extract(payload, '$.event') = ? ORDER BY id"
    return [json.loads(payload) for (payload,) in db.execute(query, (event,))]


def broken_links(db: sqlite3.Connection, origin: str) -> Iterator[str]:
    """Yield what shows that an entry was altered, added or taken away."""
    before = origin
    for number, (previous, payload, link) in enumerate(
        db.execute("SELECT previous, payload, hash FROM events ORDER BY id"), 1
    ):
        if previous != before or link != _link(previous, payload):
            yield f"event {number} is not what was logged there"
        before = link


def _link(previous: str, payload: str) -> str:
    return hashlib.sha256((previous + payload).encode()).hexdigest()
