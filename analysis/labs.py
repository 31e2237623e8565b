"""Several files of votes as one test: the laboratories of a round robin."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from analysis.scale import Description
from analysis.votes import contradictions, scored
from analysis.votesfile import FAULTS_LISTED, read_test
from dsis.errors import Fault, InputError


def read_labs(
    files: Sequence[Path], scale: tuple[float, float] | None = None
) -> tuple[pd.DataFrame, Description]:
    """Return the votes of all files, and scale and title of the test.

    One file is read as it is. Of several, each is a laboratory: votes whose `lab` is blank get the
    name of their file, or of its folder where files have one name. Title and words are the first's.

    Parameters
    ----------
    files
        As `analysis.read_votes` takes them.
    scale
        Lowest and highest grade; None: as each file's package or store says.

    Raises
    ------
    InputError
        A file cannot be used or is given twice, two hold the same votes, scales differ, or files
        contradict one another.
    """
    _refuse(_given_twice(files))
    tests = [read_test(file, scale) for file in files]
    if len(tests) == 1:
        return tests[0]
    first = tests[0][1]
    faults = [
        Fault(str(file), "scale", f"is {test.scale}, but {first.scale} in {files[0]}")
        for file, (_, test) in zip(files, tests, strict=True)
        if (test.scale.low, test.scale.high) != (first.scale.low, first.scale.high)
    ]
    _refuse(faults)
    names = _names(files)
    tables = [
        votes.assign(lab=votes["lab"].where(votes["lab"] != "", name))
        for name, (votes, _) in zip(names, tests, strict=True)
    ]
    votes = pd.concat(tables)
    for name in votes.columns:
        if any(name not in table for table in tables):
            votes[name] = votes[name].fillna("")  # a column that only some files have is text
    _check(votes, files, tables, first)
    _refuse(_copies(files, tables))
    return votes, first


def _refuse(faults: Sequence[Fault]) -> None:
    if faults:
        raise InputError(faults)


def _given_twice(files: Sequence[Path]) -> list[Fault]:
    """Return a fault for each file that is the same as one before it."""
    places = [file.resolve() for file in files]
    return [
        Fault(str(file), "", "is given twice: every vote would count twice")
        for at, file in enumerate(files)
        if places[at] in places[:at]
    ]


def _copies(files: Sequence[Path], tables: Sequence[pd.DataFrame]) -> list[Fault]:
    """Return a fault for each file whose scored votes are those of one before it.

    The laboratory is not compared: a copy under another name is still a copy.
    """
    key = ["observer", "stimulus", "repetition", "vote"]
    cast = [scored(table)[key].sort_values(key, ignore_index=True) for table in tables]
    faults = []
    for at, file in enumerate(files):
        twin = next((i for i in range(at) if len(cast[at]) and cast[i].equals(cast[at])), None)
        if twin is not None:
            fact = f"holds the same votes of the same observers as {files[twin]}"
            faults.append(Fault(str(file), "", fact))
    return faults


def _names(files: Sequence[Path]) -> list[str]:
    """Return a name for each file: its own, or its folder's, or with a number."""
    stems = [file.stem for file in files]
    if len(set(stems)) == len(files):
        return stems
    folders = [file.resolve().parent.name for file in files]
    if len(set(folders)) == len(files):
        return folders
    return [f"{stem}-{number}" for number, stem in enumerate(stems, 1)]


def _check(
    votes: pd.DataFrame, files: Sequence[Path], tables: Sequence[pd.DataFrame], test: Description
) -> None:
    """Raise `InputError` where one file contradicts another; rows are named `FILE:LINE`."""
    named = votes.copy()
    named.index = pd.Index(
        [
            f"{file}:{line}"
            for file, table in zip(files, tables, strict=True)
            for line in table.index
        ]
    )
    found = list(contradictions(named, test.scale.low, test.scale.high))
    faults = [Fault(str(row), column, fact) for row, column, fact in found[:FAULTS_LISTED]]
    if len(found) > len(faults):
        faults.append(Fault("", "", f"and {len(found) - len(faults)} more faults"))
    _refuse(faults)
