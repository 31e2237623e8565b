"""The report of a lab: votes of one or several laboratories, with the rejections that were decided.

Copy this file, put in your files, scale and decisions, and keep it with the votes: it is the record
of how the scores came about.
"""

import sys
from pathlib import Path

import analysis

SCALE = (1, 10)
REJECTED: list[str] = []  # pseudonyms; who is proposed, and why, is in report/rejections.csv


def main(files: list[Path], out: Path) -> None:
    """Print what screens propose, and write the report without whom `REJECTED` names."""
    votes, _ = analysis.read_labs(files, SCALE)
    for row in analysis.propose_rejections(votes).itertuples():
        decided = "left out" if row.observer in REJECTED else "kept"
        sys.stdout.write(f"{row.observer}: {row.methods} ({row.reason}): {decided}\n")
    analysis.write_report(files, out, SCALE, rejected=REJECTED)
    sys.stdout.write(f"report in {out / 'report.html'}\n")


if __name__ == "__main__":
    paths = [Path(argument) for argument in sys.argv[1:]]
    main(paths, paths[0].with_name("report"))
