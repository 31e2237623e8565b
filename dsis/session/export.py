"""Votes out of the store: tables that any program reads, and what each of their columns means."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dsis.errors import InputError
from dsis.manifest import Manifest, read_manifest
from dsis.outdir import UNFINISHED, result_folder
from dsis.session.columns import (
    OBSERVERS,
    PRESENTATIONS,
    STIMULI,
    STIMULUS_SHA256,
    VOTES,
    Column,
    Shown,
    Stimulus,
)
from dsis.session.store import Store, read_store

PACKAGE = "datapackage.json"
SCHEMA = "dsis-votes/1"
TABLES = ("votes", "presentations", "observers", "stimuli")

_Table = tuple[Sequence[Column], Sequence[object]]


def export_votes(folder: Path, out: Path) -> None:
    """Write `votes.csv` with `presentations`, `observers`, `stimuli` and `datapackage.json`.

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
    manifest = read_manifest(folder)
    with read_store(folder) as store:
        tables = _tables(store, manifest)
        package = _package(store, manifest, tables)
    with result_folder(out, PACKAGE, keep=_not_ours) as partial:
        for name, (columns, entries) in tables.items():
            text = _csv(columns, entries)
            (partial / f"{name}.csv").write_text(text, encoding="utf-8", newline="")
        text = json.dumps(package, indent=1, ensure_ascii=False) + "\n"
        (partial / PACKAGE).write_text(text, encoding="utf-8", newline="")


def _tables(store: Store, manifest: Manifest) -> dict[str, _Table]:
    """Return columns and rows of every table."""
    clips = {clip.stimulus: clip for clip in manifest.clips}
    shown = [
        Shown(row.observer, row.presentation, clips[row.presentation.stimulus], row.vote)
        for row in store.rows()
    ]
    voted = [entry for entry in shown if entry.vote is not None]
    if not voted:
        raise InputError.of(store.path, "", "holds no vote yet")
    hashed = any(entry.sha256 is not None for entry in voted)
    columns = (*VOTES, STIMULUS_SHA256) if hashed else VOTES
    tables: list[_Table] = [
        (columns, voted),
        (PRESENTATIONS, shown),
        (OBSERVERS, store.observers()),
        (STIMULI, [Stimulus(clip) for clip in manifest.clips]),
    ]
    return dict(zip(TABLES, tables, strict=True))


def _package(store: Store, manifest: Manifest, tables: dict[str, _Table]) -> dict[str, Any]:
    """Return what `datapackage.json` says of the test and of every column."""
    simulated = [row.vote.simulated for row in store.rows() if row.vote is not None]
    some = "some" if any(simulated) else "none"
    return {
        "schema": SCHEMA,
        "title": manifest.title,
        "scale": list(manifest.session.scale),
        "labels": list(manifest.session.labels),
        "simulated": "all" if all(simulated) else some,
        "manifest_sha256": store.manifest_sha256,
        "resources": [
            {
                "name": name,
                "path": f"{name}.csv",
                "schema": {"fields": [column.field() for column in columns]},
            }
            for name, (columns, _) in tables.items()
        ],
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
    known = {PACKAGE, UNFINISHED, *(f"{name}.csv" for name in TABLES)}
    other = sorted(path.name for path in out.iterdir() if path.name not in known)
    return ", ".join(other) or None
