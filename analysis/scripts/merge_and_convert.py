"""Votes from anywhere to anywhere: into one `votes.csv`, a wide table and sureal's JSON."""

import sys
from pathlib import Path

import analysis

SCALE = (1, 10)


def main(files: list[Path], out: Path) -> None:
    """Read `files` as the laboratories of one test, and write them in three forms."""
    votes, test = analysis.read_labs(files, SCALE)
    out.mkdir(exist_ok=True)
    analysis.write_votes(votes, out / "votes.csv")
    one_column_each = votes.assign(observer=votes["lab"] + "/" + votes["observer"], lab="")
    analysis.write_wide(one_column_each, out / "wide.csv")
    analysis.write_sureal(votes, out / "sureal.json", test.scale)
    sys.stdout.write(f"{len(votes)} votes in {out}\n")


if __name__ == "__main__":
    main([Path(argument) for argument in sys.argv[2:]], Path(sys.argv[1]))
