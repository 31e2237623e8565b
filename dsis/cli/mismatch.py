"""`dsis mismatch`: what physics a camera model leaves out."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dsis.cli.arguments import Add, add_jobs, add_scheduler, add_seed
from dsis.cli.progress import progress_bar

if TYPE_CHECKING:
    from analysis.mismatch.folders import Diagnosis


def add_mismatch(add: Add) -> None:
    """Say what `dsis mismatch` takes."""
    sub = add(
        "mismatch",
        mismatch,
        "Say where recordings differ from a camera model, and what physics it leaves out.",
        "mismatch camera.toml recording -o diagnosis",
    )
    sub.add_argument("camera", type=Path, metavar="camera.toml")
    recordings = "folder with recording.toml, or an EMVA 1288 descriptor file; one or several"
    sub.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING", help=recordings)
    out = "mismatch.json, report.html, camera.toml; of several recordings: a folder for each"
    sub.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help=out)
    without = "effects that must not be named; may be given several times"
    sub.add_argument(
        "--without", nargs="+", action="extend", default=[], metavar="EFFECT", help=without
    )
    only = "say where they differ and stop: no physics is looked for"
    sub.add_argument("--locate-only", action="store_true", help=only)
    add_jobs(sub)
    add_scheduler(sub)
    add_seed(sub, "default: 0")


def mismatch(options: argparse.Namespace) -> None:
    """Say where recordings differ from a camera model, and what physics it leaves out."""
    from analysis.mismatch.folders import diagnose_recordings

    done: list[Diagnosis] = []
    found: Sequence[Diagnosis] = done
    try:
        with progress_bar("mismatch") as progress:
            found = diagnose_recordings(
                options.camera,
                options.recordings,
                options.out,
                seed=options.seed or 0,
                jobs=options.jobs,
                without=options.without,
                locate_only=options.locate_only,
                scheduler=options.scheduler,
                progress=progress,
                finished=done.append,
            )
    finally:
        _say(found)  # where one recording fails, what was found in others before it is on disk


def _say(found: "Sequence[Diagnosis]") -> None:
    from analysis.mismatch.report.summary import comparison, summary

    for one in found:
        print(f"# {one.name}\n\n{summary(one.finding)}")
    if len(found) > 1:
        print(comparison({one.name: one.finding for one in found}))
    for one in found:
        print(f"report in {one.folder / 'report.html'}, model in {one.folder / 'camera.toml'}")
