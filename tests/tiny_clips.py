"""A test of tiny clips, and the tables that a session writes."""

import csv

from dsis.manifest import Clip, ClipFiles, Manifest, write_manifest
from dsis.spec import Sequence, Session

SIZE = Sequence(width=16, height=12, fps=25.0, seconds=0.16)  # 4 frames
NOW = "2026-03-01T09:30:00.000+01:00"


def write_test(folder, files=None, **session):
    """Two contents of two test clips; `files` makes the manifest's entry for the first of them."""
    folder.mkdir(exist_ok=True)
    clips = []
    for content in ("city", "land"):
        for name in ("reference", "one", "two"):
            stimulus = f"{content}__{name}"
            (folder / f"{stimulus}.rgb").write_bytes(bytes(SIZE.frames * 16 * 12 * 3))
            entry = {"player": ClipFiles(path=f"{stimulus}.rgb")}
            if files is not None and stimulus == "city__one":
                entry = files
            role = "reference" if name == "reference" else "test"
            reference = None if role == "reference" else f"{content}__reference"
            clips.append(
                Clip(
                    stimulus=stimulus, content=content, role=role, reference=reference, files=entry
                )
            )
    manifest = Manifest(
        schema="dsis-manifest/1",
        title="By hand",
        sequence=SIZE,
        session=Session(**{"training": 0, "dummies": 1, "observers": 4, **session}),
        clips=tuple(clips),
    )
    write_manifest(manifest, folder)
    return manifest


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
