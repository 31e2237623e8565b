"""All figures of speed and growth in one table: `python benchmarks/all.py [NAME ...] [--csv FILE]`.

Names: demosaicking, noise, pipeline, scaling. Peers that are not installed are left out (extra
`bench`). Ratios of one run are what to compare: other work on the machine changes the rest.
"""

import argparse
from pathlib import Path

import demosaicking
import noise
import pipeline
import scaling
from timing import Row, machine, show, write_csv

ALL = {"demosaicking": demosaicking, "noise": noise, "pipeline": pipeline, "scaling": scaling}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--csv", type=Path, default=Path("benchmarks.csv"), metavar="FILE")
    options = parser.parse_args()
    unknown = set(options.names) - set(ALL)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: must be of {', '.join(ALL)}")
    print("; ".join(f"{key} {value}" for key, value in machine().items()))
    rows: list[Row] = []
    for name in options.names or ALL:
        for row in ALL[name].rows():
            rows += show([row])
            write_csv(rows, options.csv)  # at once: a run that is ended keeps what it measured
    print(f"table in {options.csv}")


if __name__ == "__main__":
    main()
