"""`dsis report`: votes to mean opinion scores."""

import argparse
from pathlib import Path

from dsis.cli.arguments import Add, add_scale, number, whole


def add_report(add: Add) -> None:
    """Say what `dsis report` takes."""
    sub = add(
        "report",
        report,
        "Write the MOS report of a table of votes.",
        "report votes/votes.csv --out report",
    )
    files = "votes.csv, wide CSV, sureal's .json or a stimuli folder; several: laboratories"
    sub.add_argument("votes", type=Path, nargs="+", metavar="VOTES.csv", help=files)
    sub.add_argument("--out", type=Path, metavar="DIR", help="default: VOTES-report")
    add_scale(sub)
    reject = "observer to leave out, may be repeated: your decision, never the report's"
    sub.add_argument("--reject", action="append", default=[], metavar="OBSERVER", help=reject)
    accept = "an earlier report's rejections.csv, with accept set to true where you agree"
    sub.add_argument("--accept", type=Path, metavar="FILE", help=accept)
    threshold = "standard deviations beyond which votes are removed (default: 2)"
    sub.add_argument("--threshold", type=number(1.0), default=2.0, metavar="SD", help=threshold)
    passes = "how often they are (default: 1)"
    sub.add_argument("--passes", type=whole(1, 100), default=1, metavar="N", help=passes)


def report(options: argparse.Namespace) -> None:
    """Write the MOS report."""
    from analysis.figures import simulated_mark
    from analysis.rejection import read_accepted
    from analysis.report import write_report

    first: Path = options.votes[0]
    out = options.out or first.with_name(f"{first.stem}-report")
    accepted = [] if options.accept is None else read_accepted(options.accept)
    results = write_report(
        options.votes,
        out,
        tuple(options.scale) if options.scale else None,
        rejected=options.reject,
        accepted=accepted,
        threshold=options.threshold,
        passes=options.passes,
    )
    mark = simulated_mark(results.counts.simulated_share)
    if mark:
        print(f"{mark}: these scores are not those of people")
    print(mos_table(out / "mos.csv"))
    for remark in results.remarks:
        print(f"- {remark}")
    print(f"report in {out / 'report.html'}")


def mos_table(path: Path) -> str:
    """Return the scores of `mos.csv`, two decimals, as text."""
    import pandas as pd

    scores = pd.read_csv(path)
    columns = ["stimulus", "n", "mos", "ci_low", "ci_high", "n_removed", "mos_trimmed"]
    return str(scores[columns].round(2).to_string(index=False))
