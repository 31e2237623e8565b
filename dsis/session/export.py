"""Votes out of the store: tables that any program reads, and what each of their columns means."""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

from dsis.errors import InputError
from dsis.manifest import Manifest, read_manifest
from dsis.outdir import UNFINISHED, result_folder
from dsis.session.columns import (
    DISPLAYS,
    LAB,
    OBSERVERS,
    PEOPLE,
    PRESENTATIONS,
    STIMULI,
    STIMULUS_SHA256,
    VOTES,
    Column,
    Confirmed,
    Person,
    Showing,
    Shown,
    Stimulus,
)
from dsis.session.framelog import frame_log, packed
from dsis.session.personal import read_records
from dsis.session.setup import Display, current_setup
from dsis.session.store import Store, read_store
from dsis.session.sureal import sureal_dataset

PACKAGE = "datapackage.json"
SCHEMA = "dsis-votes/1"
TABLES = ("votes", "presentations", "observers", "stimuli", "displays", "people")
FRAMES, SUREAL = "frames.jsonl.gz", "sureal.json"
FILES = {
    FRAMES: "a line of JSON for every clip shown: when each of its frames was painted",
    SUREAL: "valid votes on the test, as a dataset of the program sureal",
}

Simulated = Literal["all", "some", "none"]
_Table = tuple[Sequence[Column], Sequence[object]]


def export_votes(folder: Path, out: Path, *, personal: bool = False) -> Simulated:
    """Write `votes.csv` and the tables beside it, frame log, sureal's JSON and `datapackage.json`.

    The same votes give the same bytes. A session may be running: its votes so far are written.

    Parameters
    ----------
    folder
        The stimuli folder, with its manifest and its session.
    out
        A new folder, or an earlier export, which is replaced.
    personal
        Write `people.csv` too: age groups and screening of the observers.

    Returns
    -------
    Simulated
        Whether all, some or none of the votes are simulated.

    Raises
    ------
    InputError
        There is no vote, or `out` holds something else.
    DamagedError
        The store is damaged, or votes or log were altered.
    """
    manifest = read_manifest(folder)
    with read_store(folder) as store:
        store.check()
        logs = list(frame_log(store))
        shown = list(_shown(store, manifest, logs))
        tables = _tables(store, manifest, shown)
        if personal:
            records = read_records(folder).items()
            tables["people"] = (
                PEOPLE,
                [Person(name, at, record) for name, (at, record) in records],
            )
        simulated = _simulated(shown)
        package = _package(store, manifest, tables, simulated)
        sureal = sureal_dataset(manifest, shown)
    with result_folder(out, PACKAGE, keep=_not_ours) as partial:
        for name, (columns, entries) in tables.items():
            text = _csv(columns, entries)
            (partial / f"{name}.csv").write_text(text, encoding="utf-8", newline="")
        (partial / FRAMES).write_bytes(packed(iter(logs)))
        for name, values in ((SUREAL, sureal), (PACKAGE, package)):
            text = json.dumps(values, indent=1, ensure_ascii=False) + "\n"
            (partial / name).write_text(text, encoding="utf-8", newline="")
    return simulated


def _shown(store: Store, manifest: Manifest, logs: list[dict[str, Any]]) -> Iterator[Shown]:
    """Yield every presentation with its vote and with how it was shown."""
    clips = {clip.stimulus: clip for clip in manifest.clips}
    lab = current_setup(store, manifest.session).lab
    by_place: dict[tuple[str, int], list[dict[str, Any]]] = {}
    for log in logs:
        by_place.setdefault((log["observer"], log["presentation"]), []).append(log)
    for row in store.rows():
        p = row.presentation
        mine = by_place.get((row.observer, p.place), [])
        yield Shown(row.observer, p, clips[p.stimulus], row.vote, lab, _showing(mine))


def _showing(logs: list[dict[str, Any]]) -> Showing:
    if not logs:
        return Showing()
    stayed = [log["longest_interval_ms"] for log in logs if log["longest_interval_ms"] is not None]
    names = ("started_at", "refresh_hz", "device_pixel_ratio", "full_screen")
    known = {name: logs[0][name] for name in names}
    return Showing(**known, longest_interval_ms=max(stayed, default=None))


def _tables(store: Store, manifest: Manifest, shown: list[Shown]) -> dict[str, _Table]:
    """Return columns and rows of every table."""
    voted = [entry for entry in shown if entry.vote is not None]
    if not voted:
        raise InputError.of(store.path, "", "holds no vote yet")
    hashed = any(entry.sha256 is not None for entry in voted)
    columns = (*VOTES, STIMULUS_SHA256) if hashed else VOTES
    if any(entry.lab for entry in voted):
        columns = (LAB, *columns)
    tables: dict[str, _Table] = {
        "votes": (columns, voted),
        "presentations": (PRESENTATIONS, shown),
        "observers": (OBSERVERS, store.observers()),
        "stimuli": (STIMULI, [Stimulus(clip) for clip in manifest.clips]),
    }
    displays = [_confirmed(fact) for fact in store.events("display")]
    if displays:
        tables["displays"] = (DISPLAYS, displays)
    return tables


def _confirmed(fact: dict[str, Any]) -> Confirmed:
    player = fact.get("player")
    return Confirmed(
        observer=fact["observer"],
        confirmed_at=fact["at"],
        display=Display.model_validate_json(json.dumps(fact["display"])),
        steps_seen=fact["steps_seen"],
        pixels_even=fact["pixels_even"],
        player="page" if player is None else f"{player['player']} {player['version']}",
        browser=str(fact["measured"].get("browser", "")),
        note=fact["note"],
    )


def _simulated(shown: Sequence[Shown]) -> Simulated:
    marks = [entry.vote.simulated for entry in shown if entry.vote is not None]
    if all(marks):
        return "all"
    return "some" if any(marks) else "none"


def _package(
    store: Store, manifest: Manifest, tables: dict[str, _Table], simulated: Simulated
) -> dict[str, Any]:
    """Return what `datapackage.json` says of the test, of every column and of the other files."""
    return {
        "schema": SCHEMA,
        "title": manifest.title,
        "scale": list(manifest.session.scale),
        "labels": list(manifest.session.labels),
        "simulated": simulated,
        "manifest_sha256": store.manifest_sha256,
        "resources": [
            {
                "name": name,
                "path": f"{name}.csv",
                "schema": {"fields": [column.field() for column in columns]},
            }
            for name, (columns, _) in tables.items()
        ],
        "files": [{"path": path, "description": says} for path, says in FILES.items()],
    }


def _csv(columns: Sequence[Column], entries: Sequence[object]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([column.name for column in columns])
    writer.writerows([[column.cell(entry) for column in columns] for entry in entries])
    return text.getvalue()


def _not_ours(out: Path) -> str | None:
    """Return what in an earlier export is not of ours."""
    if (out / PACKAGE).is_file():
        try:
            ours = json.loads((out / PACKAGE).read_text(encoding="utf-8"))["schema"] == SCHEMA
        except (ValueError, KeyError, TypeError):
            ours = False
        if not ours:
            return f"a {PACKAGE} that is no export of votes"
    known = {PACKAGE, UNFINISHED, *FILES, *(f"{name}.csv" for name in TABLES)}
    other = sorted(path.name for path in out.iterdir() if path.name not in known)
    return ", ".join(other) or None
