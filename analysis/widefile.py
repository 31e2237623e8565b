"""Wide CSV: one row a stimulus, one column an observer; a common form of spreadsheets."""

from dataclasses import replace
from pathlib import Path

import pandas as pd

from analysis.table import to_csv
from analysis.votes import COLUMNS, CONDITION, scored
from dsis.errors import Fault, InputError

ABOUT_STIMULI = ("lab", *CONDITION, "kind", "repetition", "session", "simulated")
"""Columns of a wide table, beside `stimulus`, that are no observers."""
SUMMARIES = ("mos", "mean", "average", "median", "sd", "std", "stddev", "variance")


def is_wide(header: list[str]) -> bool:
    """Return whether a header is that of a wide table: stimuli, observers' names, no votes."""
    names = set(header)
    observers = names - {"stimulus", *ABOUT_STIMULI, *(column.name for column in COLUMNS)}
    return "stimulus" in names and not {"observer", "vote", "subject"} & names and bool(observers)


def lengthen(
    header: list[str], lines: list[int], rows: list[list[str]]
) -> tuple[list[str], list[int], list[list[str]]]:
    """Return header, lines and rows of the same table with one row a vote; blank cells are kept."""
    known = ["stimulus", *ABOUT_STIMULI]
    others = {column.name for column in COLUMNS} - set(known)
    faults = [
        Fault("wide table", name, "is no observer: take this column out")
        for name in header
        if name in others or name.lower() in SUMMARIES
    ]
    if faults:
        raise InputError(faults)
    fixed = [at for at, name in enumerate(header) if name in known]
    observers = [at for at, name in enumerate(header) if name not in known]
    long_header = [*(header[at] for at in fixed), "observer", "vote"]
    long_lines, long_rows = [], []
    for line, row in zip(lines, rows, strict=True):
        about = [row[at] for at in fixed]
        long_lines += [line] * len(observers)
        long_rows += [[*about, header[at], row[at]] for at in observers]
    return long_header, long_lines, long_rows


def write_wide(votes: pd.DataFrame, path: Path) -> None:
    """Write the scored votes with one row a stimulus and repetition, one column an observer.

    Where votes are simulated, a column says so; those of people then stand in rows of their own.

    Raises
    ------
    InputError
        Observers of two labs have one name, or an observer's name is that of another column.
    """
    rows = scored(votes)
    people = rows[["lab", "observer"]].drop_duplicates()
    twice = sorted(set(people.loc[people.duplicated("observer"), "observer"]))
    reserved = {"stimulus", "observer", "vote", "subject", *ABOUT_STIMULI}
    taken = sorted(set(people["observer"]) & reserved)
    if twice or taken:
        fact = "stands in several labs" if twice else "is the name of another column"
        raise InputError.of("observer", ", ".join(twice or taken), f"{fact}: cannot be a column")
    about = ["stimulus", *CONDITION, "kind", "repetition"]
    if rows["simulated"].any():
        about.append("simulated")
    key = ["stimulus", "repetition", "simulated"]
    by_stimulus = {
        one: dict(zip(mine["observer"], mine["vote"], strict=True))
        for one, mine in rows.groupby(key, sort=True)
    }
    first = rows.drop_duplicates(key).set_index(key)
    table = first.loc[list(by_stimulus)].reset_index()[about]
    observers = people["observer"].tolist()
    for name in observers:
        table[name] = [of_one.get(name) for of_one in by_stimulus.values()]
    kinds = {column.name: column for column in COLUMNS}
    numbers = [replace(kinds["vote"], name=name) for name in observers]
    text = to_csv(table, [*(kinds[name] for name in about), *numbers])
    path.write_text(text, encoding="utf-8", newline="")
