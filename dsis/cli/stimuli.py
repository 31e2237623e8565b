"""`dsis stimuli`: build, check or estimate the sequences of a test."""

import argparse
from pathlib import Path

from dsis.cli.arguments import Add, add_jobs, add_scheduler, add_seed
from dsis.cli.progress import progress_bar
from dsis.errors import InputError


def add_stimuli(add: Add) -> None:
    """Say what `dsis stimuli` takes."""
    sub = add(
        "stimuli",
        stimuli,
        "Build the sequences that a test spec names, with a manifest.",
        "stimuli stills.toml --source photos/ --out stimuli",
    )
    spec = "a file, the name of a spec that comes with dsis, or a manifest.json"
    sub.add_argument("spec", nargs="?", metavar="SPEC.toml", help=spec)
    sub.add_argument("--out", type=Path, metavar="DIR", help="default: SPEC-stimuli")
    frames = "your frames instead of the spec's content"
    sub.add_argument("--source", nargs="+", default=[], metavar="FILES", help=frames)
    sub.add_argument("--dry-run", action="store_true", help="say disk, memory, time; build nothing")
    check = "verify every frame against the manifest"
    sub.add_argument("--check", type=Path, metavar="DIR", help=check)
    add_jobs(sub)
    add_scheduler(sub)
    add_seed(sub, "default: the spec's")


def stimuli(options: argparse.Namespace) -> None:
    """Build, check or estimate the stimuli of a test."""
    from dsis.spec import read_spec
    from dsis.stimuli import build_stimuli, check_stimuli, estimate, summary

    if options.check is not None:
        with progress_bar("check") as progress:
            frames = check_stimuli(options.check, jobs=options.jobs, progress=progress)
        print(f"{frames} frames agree with {options.check / 'manifest.json'}")
        return
    if options.spec is None:
        fact = "SPEC.toml is missing (or give --check DIR)"
        raise InputError.of(fact, "", "")
    test = read_spec(options.spec, options.source, options.seed)
    out = options.out or Path(f"{Path(options.spec).stem}-stimuli")
    if options.dry_run:
        print(estimate(test, out, options.jobs))
        return
    with progress_bar("stimuli") as progress:
        manifest = build_stimuli(
            test, out, jobs=options.jobs, scheduler=options.scheduler, progress=progress
        )
    print(summary(manifest))
    print(f"{len(manifest.clips)} clips in {out}")
