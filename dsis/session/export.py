"""Votes out of the store, as tables that any program reads, with what each column means."""

import csv
import io
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from dsis.errors import InputError
from dsis.manifest import Clip, Manifest, read_manifest
from dsis.outdir import check_replaceable, finish, partial_of
from dsis.session.store import Observer, Row, Store, Vote, read_store

PACKAGE = "datapackage.json"
SCHEMA = "dsis-votes/1"
T = TypeVar("T")


@dataclass(frozen=True)
class Column(Generic[T]):
    """A column of a table of `T`: type as in Table Schema (Frictionless), unit, meaning, cells."""

    name: str
    type: str
    unit: str
    description: str
    cell: Callable[[T], Any]


@dataclass(frozen=True)
class Voted:
    """A vote with its presentation and its clip."""

    row: Row
    vote: Vote
    clip: Clip


VOTES: tuple[Column[Voted], ...] = (
    Column("observer", "string", "", "pseudonym of the observer", lambda v: v.row.observer),
    Column("stimulus", "string", "", "name of the clip judged", lambda v: v.clip.stimulus),
    Column("vote", "integer", "grade", "the vote; blank: none was given", lambda v: v.vote.vote),
    Column("content", "string", "", "what the clip shows", lambda v: v.clip.content),
    Column("noise", "string", "", "noise model: awgn, sd (signal-dependent)", lambda v: v.clip.noise),
    Column("demosaic", "string", "", "demosaicking; none: never mosaicked", lambda v: v.clip.demosaic),
    Column("level", "integer", "stop", "stops of under-exposure", lambda v: v.clip.level),
    Column("session", "string", "", "viewing session", lambda v: v.row.presentation.session),
    Column(
        "presentation",
        "integer",
        "",
        "place in the observer's order, from 1",
        lambda v: v.row.presentation.place,
    ),
    Column(
        "repetition",
        "integer",
        "",
        "which showing to this observer, from 1",
        lambda v: v.row.presentation.repetition,
    ),
    Column(
        "attempt",
        "integer",
        "",
        "from 1; more where a showing had dropped frames",
        lambda v: v.row.presentation.attempt,
    ),
    Column(
        "valid",
        "boolean",
        "",
        "false: shown with dropped frames and repeated later; never scored",
        lambda v: v.vote.valid,
    ),
    Column(
        "kind",
        "string",
        "",
        "test; reference: hidden reference; training, dummy: never scored",
        lambda v: v.row.presentation.kind,
    ),
    Column(
        "reaction_ms",
        "number",
        "ms",
        "from the end of the last clip to the vote",
        lambda v: v.vote.reaction_ms,
    ),
    Column(
        "voted_at",
        "datetime",
        "",
        "time of the vote, ISO 8601 with offset; robots' clocks start in 1970",
        lambda v: v.vote.voted_at,
    ),
    Column(
        "dropped_frames",
        "integer",
        "frame",
        "frames that missed their refresh; blank: nothing was shown",
        lambda v: v.vote.dropped_frames,
    ),
    Column(
        "simulated",
        "boolean",
        "",
        "true: the vote of a simulated observer",
        lambda v: v.vote.simulated,
    ),
)
STIMULUS_SHA256: Column[Voted] = Column(
    "stimulus_sha256",
    "string",
    "",
    "SHA-256 of the clip's frames (player format)",
    lambda v: v.clip.files["player"].sha256 if "player" in v.clip.files else None,
)
PRESENTATIONS: tuple[Column[Row], ...] = (
    Column("observer", "string", "", "pseudonym of the observer", lambda r: r.observer),
    Column(
        "presentation",
        "integer",
        "",
        "place in the observer's order, from 1",
        lambda r: r.presentation.place,
    ),
    Column("session", "string", "", "viewing session", lambda r: r.presentation.session),
    Column("kind", "string", "", "test, reference, training, dummy", lambda r: r.presentation.kind),
    Column("stimulus", "string", "", "name of the clip judged", lambda r: r.presentation.stimulus),
    Column("reference", "string", "", "name of its reference", lambda r: r.presentation.reference),
    Column(
        "repetition",
        "integer",
        "",
        "which showing to this observer, from 1",
        lambda r: r.presentation.repetition,
    ),
    Column(
        "attempt",
        "integer",
        "",
        "from 1; more where a showing had dropped frames",
        lambda r: r.presentation.attempt,
    ),
    Column("seed", "integer", "", "seed of the plan", lambda r: r.presentation.seed),
    Column("state", "string", "", "planned, voted, invalid (dropped frames)", lambda r: _state(r)),
)
OBSERVERS: tuple[Column[Observer], ...] = (
    Column("observer", "string", "", "pseudonym", lambda o: o.observer),
    Column("simulated", "boolean", "", "true: a simulated observer", lambda o: o.simulated),
    Column("seed", "integer", "", "seed of the plan", lambda o: o.seed),
    Column(
        "created_at",
        "datetime",
        "",
        "when the plan was drawn, ISO 8601 with offset; robots' clocks start in 1970",
        lambda o: o.created_at,
    ),
)


def export_votes(folder: Path, out: Path) -> None:
    """Write `votes.csv`, `presentations.csv`, `observers.csv` and `datapackage.json` into `out`.

    The same votes give the same bytes. A session may be running: its votes so far are written.

    Parameters
    ----------
    folder
        The stimuli folder, with its manifest and its session.
    out
        A new folder, or an earlier export, which is replaced.

    Raises
    ------
    InputError
        There is no vote, or `out` holds something else.
    """
    _check_out(out)
    manifest = read_manifest(folder)
    with read_store(folder) as store:
        tables, package = _tables(store, manifest)
    partial = partial_of(out)
    partial.mkdir(parents=True, exist_ok=True)
    for name, text in tables.items():
        (partial / name).write_text(text, encoding="utf-8", newline="")
    text = json.dumps(package, indent=1, ensure_ascii=False) + "\n"
    (partial / PACKAGE).write_text(text, encoding="utf-8", newline="")
    finish(partial, out)


def _tables(store: Store, manifest: Manifest) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the text of every table by file name, and the package that describes them."""
    rows = store.rows()
    voted = [
        Voted(row, row.vote, manifest.clip(row.presentation.stimulus))
        for row in rows
        if row.vote is not None
    ]
    if not voted:
        raise InputError.of(store.path, "", "holds no vote yet")
    hashed = any(STIMULUS_SHA256.cell(vote) for vote in voted)
    votes = (*VOTES, STIMULUS_SHA256) if hashed else VOTES
    robots = sum(vote.vote.simulated for vote in voted)
    tables = {
        "votes.csv": _csv(votes, voted),
        "presentations.csv": _csv(PRESENTATIONS, rows),
        "observers.csv": _csv(OBSERVERS, store.observers()),
    }
    package = {
        "schema": SCHEMA,
        "title": manifest.title,
        "scale": list(manifest.session.scale),
        "labels": list(manifest.session.labels),
        "simulated": "none" if not robots else "all" if robots == len(voted) else "some",
        "manifest_sha256": store.manifest_sha256,
        "resources": [
            _resource("votes", votes),
            _resource("presentations", PRESENTATIONS),
            _resource("observers", OBSERVERS),
        ],
    }
    return tables, package


def _csv(columns: Sequence[Column[T]], values: Sequence[T]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column.name for column in columns])
    writer.writerows([[_text(column.cell(value)) for column in columns] for value in values])
    return text.getvalue()


def _text(value: object) -> str:
    """Return a cell: blank for what is not known, true and false, the shortest exact number."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def _resource(name: str, columns: Sequence[Column[Any]]) -> dict[str, Any]:
    fields = [
        {"name": c.name, "type": c.type, "unit": c.unit, "description": c.description}
        for c in columns
    ]
    return {"name": name, "path": f"{name}.csv", "schema": {"fields": fields}}


def _state(row: Row) -> str:
    if row.vote is None:
        return "planned"
    return "voted" if row.vote.valid else "invalid"


def _check_out(out: Path) -> None:
    """Refuse to replace what is not an export, or has something else in it."""
    check_replaceable(out, PACKAGE)
    if not (out / PACKAGE).is_file():
        return
    try:
        package = json.loads((out / PACKAGE).read_text(encoding="utf-8"))
        ours = package["schema"] == SCHEMA
    except (ValueError, KeyError, TypeError):
        ours = False
    if not ours:
        raise InputError.of(out, "", f"holds a {PACKAGE} that is no export of votes")
    known = {PACKAGE, "votes.csv", "presentations.csv", "observers.csv"}
    other = sorted(path.name for path in out.iterdir() if path.name not in known)
    if other:
        fact = f"holds {', '.join(other)}, which would be lost: give another folder"
        raise InputError.of(out, "", fact)
