"""Reading votes from any file that holds them, and writing `votes.csv`."""

import csv
import io
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from analysis.scale import Description, describe_test
from analysis.storefile import exported, store_folder
from analysis.surealfile import is_sureal, read_sureal
from analysis.table import DTYPES, Column, Kind, to_csv
from analysis.votes import COLUMNS, complete, contradictions, misspelt, spelling_faults
from analysis.widefile import is_wide, lengthen
from dsis.errors import Fault, InputError

FAULTS_LISTED = 20
_DELIMITERS = (",", ";", "\t")
_WHOLE_MAX = 2**53  # beyond it neighbouring whole numbers are one number

_NUMBER = re.compile(r"[0-9]+([.,][0-9]+)?")

_Found = list[tuple[int, str, str]]  # row, column, what is wrong


def read_votes(
    path: str | os.PathLike[str], scale: tuple[float, float] | None = None
) -> pd.DataFrame:
    """Return the votes of a file, with every column of `analysis.votes.COLUMNS`.

    CSV is UTF-8, with or without byte order mark; cells are parted by commas, semicolons or tabs
    (the latter two may have decimal commas). Blanks around a cell are no part of it; blank lines
    are passed over; a blank vote is a vote not given. Columns not known are kept as text, but those
    that are known and spelled otherwise (`Kind`) are refused. A table
    without the columns `observer` and `vote` is wide: one row a stimulus, one column an observer.
    A `.json` is a dataset of sureal; a stimuli folder, or the `votes.sqlite` in it, is the store
    of its session.

    Parameters
    ----------
    path
        The file, or the stimuli folder.
    scale
        Lowest and highest grade; None: as the `datapackage.json` beside the file, or the store,
        says.

    Returns
    -------
    DataFrame
        One row a vote; the index, `row`, is the line in the file (the header is line 1).

    Raises
    ------
    InputError
        Not a table, a column missing, text for a number, a vote outside the scale, a second vote
        with the same (lab, observer, stimulus, repetition), a stimulus under two conditions: every
        row at once.
    """
    return read_test(Path(path), scale)[0]


def read_test(
    file: Path, scale: tuple[float, float] | None = None
) -> tuple[pd.DataFrame, Description]:
    """Return the votes as `read_votes` does, and the scale and title of the test."""
    folder = store_folder(file)
    if folder is not None:
        with exported(folder) as votes_csv:
            test = describe_test(votes_csv, scale)
            return _read_csv(votes_csv, test, file), test
    test = describe_test(file, scale)
    if is_sureal(file):
        votes = complete(read_sureal(file))
        votes.index = pd.RangeIndex(1, len(votes) + 1, name="row")
        _check(file, votes, test, [], where="vote")
        return votes, test
    return _read_csv(file, test), test


def _read_csv(file: Path, test: Description, called: Path | None = None) -> pd.DataFrame:
    """Read the table in `file`; faults are named as of `called`, where that is given."""
    delimiter, header, lines, rows = _cells(file)
    wide = is_wide(header)
    if wide:
        header, lines, rows = lengthen(header, lines, rows)
    found: _Found = []
    columns: dict[str, pd.Series] = {}
    cells: Iterable[Sequence[str]] = zip(*rows, strict=True) if rows else [[]] * len(header)
    observers = [row[-2] for row in rows] if wide else []
    for column, texts in zip(header, cells, strict=True):
        known = next((c for c in COLUMNS if c.name == column), None)
        if known is None:
            columns[column] = pd.Series(texts, lines, dtype="str")
        else:
            values, faults = _parse_column(known, texts, decimal_comma=delimiter != ",")
            columns[column] = pd.Series(values, lines, dtype=DTYPES[known.kind])
            found += [
                (lines[at], observers[at] if wide and column == "vote" else column, fact)
                for at, fact in faults
            ]
    votes = complete(pd.DataFrame(columns, index=pd.Index(lines, name="row")))
    if wide:  # a row of the file holds many votes: say whose is outside
        low, high = test.scale.low, test.scale.high
        outside = votes[(votes["vote"] < low) | (votes["vote"] > high)]
        for row in outside.itertuples():
            fact = f"is {row.vote:g}, must be from {low:g} to {high:g}"
            found.append((int(str(row.Index)), str(row.observer), fact))
    _check(called or file, votes, test, found)
    return votes


def _check(
    file: Path, votes: pd.DataFrame, test: Description, found: _Found, where: str = "row"
) -> None:
    """Raise `InputError` with what was `found`, and with what contradicts scale or other rows."""
    sound = votes.drop(index=list({row for row, _, _ in found}))
    found = [*found, *contradictions(sound, test.scale.low, test.scale.high)]
    if found:
        raise InputError(_faults(str(file), found, where))


def write_votes(votes: pd.DataFrame, path: str | os.PathLike[str]) -> None:
    """Write votes as CSV, every column of `analysis.votes.COLUMNS` and then the others."""
    Path(path).write_text(to_csv(complete(votes), COLUMNS), encoding="utf-8", newline="")


def _cells(file: Path) -> tuple[str, list[str], list[int], list[list[str]]]:
    """Return delimiter, header, the line each row starts on, and the stripped cells of each row."""
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError.of(file, "", "is not UTF-8 text (save it as CSV UTF-8)") from None
    except OSError as error:
        raise InputError.of(file, "", f"cannot be read: {error.strerror}") from None
    delimiter = _delimiter(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    lines: list[int] = []
    rows: list[list[str]] = []
    line = 1
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                rows.append(cells)
                lines.append(line)
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError.of(file, f"row {line}", f"is not CSV: {error}") from None
    if not rows:
        raise InputError.of(file, "", "is empty")
    header = rows.pop(0)
    _check_shape(file, header, lines.pop(0), lines, rows)
    return delimiter, header, lines, rows


def _delimiter(text: str) -> str:
    """Return the delimiter whose header has the most cells that are known columns."""
    header = next((line for line in text.splitlines() if line.strip()), "")
    known = {column.name for column in COLUMNS}

    def hits(delimiter: str) -> int:
        return len(known & {cell.strip(' "') for cell in header.split(delimiter)})

    # A wide table may have but one known column: then the delimiter that stands most often.
    return max(_DELIMITERS, key=lambda delimiter: (hits(delimiter), header.count(delimiter)))


def _check_shape(
    file: Path, header: list[str], at: int, lines: list[int], rows: list[list[str]]
) -> None:
    known, wrong = ", ".join(header), misspelt(header)
    wide = is_wide([wrong.get(name, name) for name in header])
    votes_under = _observers_perhaps(wrong, header, rows) if wide else {}
    wrong = {name: meant for name, meant in wrong.items() if votes_under.get(name) is not True}
    found: _Found = [
        (at, name, f"{fact}; an observer needs another name" if name in votes_under else fact)
        for name, fact in spelling_faults(wrong).items()
    ]
    found += [
        (at, column.name, f"column is missing; found here: {known}{_other_names(column, header)}")
        for column in COLUMNS
        if column.required and column.name not in (*header, *wrong.values()) and not wide
    ]
    found += [
        (at, name or "header", f"stands {header.count(name)} times" if name else "has no name")
        for name in dict.fromkeys(header)
        if not name or header.count(name) > 1
    ]
    if not found and not rows:
        raise InputError.of(file, "", "holds a header and no votes")
    found += [
        (line, "", "holds a NUL byte (save the file as CSV UTF-8, not UTF-16)")
        for line, row in [(at, header), *zip(lines, rows, strict=True)]
        if any("\0" in cell for cell in row)
    ]
    found += [
        (line, "", f"has {len(row)} cells, the header {len(header)}")
        for line, row in zip(lines, rows, strict=True)
        if len(row) != len(header)
    ]
    if found:
        raise InputError(_faults(str(file), found))


def _observers_perhaps(
    wrong: dict[str, str], header: list[str], rows: list[list[str]]
) -> dict[str, bool]:
    """Return which misspelt columns of a wide table hold numbers, as an observer's would.

    True: they are nothing that the column meant can hold, so they are votes.
    """
    perhaps = {}
    for name, meant in wrong.items():
        at = header.index(name)
        cells = {row[at] for row in rows if at < len(row)} - {""}
        if cells and all(_NUMBER.fullmatch(cell) for cell in cells):
            column = next(c for c in COLUMNS if c.name == meant)
            perhaps[name] = not any(_can_hold(column, cell) for cell in cells)
    return perhaps


def _can_hold(column: Column, cell: str) -> bool:
    try:
        column.parse(cell, decimal_comma="," in cell)
    except ValueError:
        return False
    return True


def _other_names(column: Column, header: list[str]) -> str:
    """Return what to rename, where a table calls observers subjects."""
    if column.name != "observer" or "subject" not in header:
        return ""
    kind = " (and is_reference to kind: test or reference)" if "is_reference" in header else ""
    return f"; rename subject to observer{kind}"


def _parse_column(
    column: Column, texts: Sequence[str], *, decimal_comma: bool
) -> tuple[list[object], list[tuple[int, str]]]:
    """Return the values, and (place, what is wrong) of the cells that have none.

    Each distinct text is parsed once: a column of votes has ten.
    """
    codes, distinct = pd.factorize(np.array(texts, dtype=object))
    values: list[object] = []
    wrong: dict[int, str] = {}
    for code, text in enumerate(distinct):
        try:
            value = column.parse(str(text), decimal_comma=decimal_comma)
            if column.kind is Kind.WHOLE and isinstance(value, float):
                _check_whole(value)
            values.append(value)
        except ValueError as error:
            values.append(column.default if not column.filled else "")
            wrong[code] = str(error)
    faults = [
        (int(at), wrong[int(codes[at])]) for at in np.flatnonzero(np.isin(codes, list(wrong)))
    ]
    return [values[code] for code in codes], faults


def _check_whole(value: float) -> None:
    if abs(value) > _WHOLE_MAX:
        fact = f"is {value:g}, must be at most 2^53 = {_WHOLE_MAX}"
        raise ValueError(fact)


def _faults(file: str, found: _Found, where: str = "row") -> list[Fault]:
    """Return the first faults by row, and how many more there are."""
    in_order = sorted(found)
    listed = [
        Fault(file, f"{where} {row}, {column}" if column else f"{where} {row}", fact)
        for row, column, fact in in_order[:FAULTS_LISTED]
    ]
    more = len(in_order) - len(listed)
    return [*listed, Fault(file, "", f"and {more} more faults")] if more else listed
