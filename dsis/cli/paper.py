"""`dsis paper`: the paper's tables and figures, recomputed."""

import argparse
from pathlib import Path

from dsis.cli.arguments import Add, add_jobs, add_scale, add_seed
from dsis.cli.progress import progress_bar


def add_paper(add: Add) -> None:
    """Say what `dsis paper` takes."""
    sub = add(
        "paper",
        paper,
        "Recompute the paper's tables and figures, printed beside the published numbers.",
        "paper table1 --kodak kodak/ --out paper",
    )
    names = (
        "of claims, fig1, fig2, table1, equation5, fig3, fig4, fig5, fig6, table2 (default: all)"
    )
    sub.add_argument("names", nargs="*", metavar="NAME", help=names)
    sub.add_argument("--out", type=Path, default=Path("dsis-paper"), metavar="DIR")
    full = (
        "20 frames of 1920 x 1080, about an hour of one processor; "
        "default: 1 frame of 480 x 270, minutes"
    )
    sub.add_argument("--full", action="store_true", help=full)
    kodak = "folder of the 24 Kodak images (default: $DSIS_SHARED_DATA/kodak, else City)"
    sub.add_argument("--kodak", type=Path, metavar="FOLDER", help=kodak)
    votes = "votes of a test with the paper's conditions, for Fig. 6 (default: robots)"
    sub.add_argument("--votes", type=Path, metavar="FILE", help=votes)
    add_scale(sub)
    recording = "a real camera's recording for Fig. 2 (default: that of $DSIS_SHARED_DATA)"
    sub.add_argument("--recording", type=Path, metavar="RECORDING", help=recording)
    add_jobs(sub)
    add_seed(sub, "default: 1")


def paper(options: argparse.Namespace) -> None:
    """Recompute the tables and figures of the paper."""
    from analysis.paper import Setting, kodak_images, real_recording, write_paper

    setting = Setting(
        kodak=kodak_images(options.kodak),
        recording=real_recording(options.recording),
        votes=options.votes,
        scale=tuple(options.scale) if options.scale else None,
        full=options.full,
        seed=1 if options.seed is None else options.seed,
        jobs=options.jobs,
    )
    with progress_bar("paper") as progress:
        parts = write_paper(options.out, setting, options.names, progress)
    for part in parts:
        print(f"{part.title}: {len(part.pictures)} figures, {len(part.all_tables())} tables")
    print(f"page in {options.out / 'paper.html'}")
