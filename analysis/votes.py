"""The table of votes: its columns, and which of its rows are scored.

A table of votes is a data frame with one row a vote. Needed are `observer`, `stimulus` and `vote`;
every other column of `COLUMNS` may be absent and then has its default everywhere.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.table import DTYPES, Column, Kind
from analysis.table import codebook as table_codebook
from dsis.errors import Fault, InputError

TABLE = "votes"  # what messages call a table that came from no file
SCORED_KINDS = ("test", "reference")

COLUMNS = (
    Column("lab", Kind.TEXT, "", "laboratory; observers of two labs are two people", default=""),
    Column("observer", Kind.TEXT, "", "pseudonym of the observer", required=True, filled=True),
    Column("stimulus", Kind.TEXT, "", "name of the sequence judged", required=True, filled=True),
    Column("content", Kind.TEXT, "", "what the sequence shows", default=""),
    Column("noise", Kind.TEXT, "", "noise model: awgn, sd (signal-dependent) ...", default=""),
    Column("demosaic", Kind.TEXT, "", "demosaicking, or none: never mosaicked", default=""),
    Column("level", Kind.NUMBER, "stop", "stops of under-exposure"),
    Column("session", Kind.TEXT, "", "viewing session", default=""),
    Column("presentation", Kind.WHOLE, "", "place in the observer's order, from 1", least=1),
    Column(
        "repetition", Kind.WHOLE, "", "which showing to this observer, from 1", default=1, least=1
    ),
    Column("attempt", Kind.WHOLE, "", "from 1; more where a showing failed", default=1, least=1),
    Column(
        "valid",
        Kind.FLAG,
        "",
        "false: shown with dropped frames and repeated later; never scored",
        default=True,
    ),
    Column(
        "kind",
        Kind.TEXT,
        "",
        "test; reference: hidden reference; training, dummy: never scored",
        default="test",
        allowed=("test", "training", "dummy", "reference"),
    ),
    Column("vote", Kind.NUMBER, "grade", "the vote; blank: none was given", required=True),
    Column("reaction_ms", Kind.NUMBER, "ms", "time from the end of the clip to the vote", least=0),
    Column("voted_at", Kind.TIME, "", "local time of the vote, ISO 8601 with offset", default=""),
    Column("dropped_frames", Kind.WHOLE, "frame", "frames that missed their refresh", least=0),
    Column("simulated", Kind.FLAG, "", "true: the vote of a simulated observer", default=False),
)
_DTYPES = {column.name: pd.Series(dtype=DTYPES[column.kind]).dtype for column in COLUMNS}
SIMULATED = Column("simulated", Kind.FLAG, "", "true: simulated votes are among these")
"""The mark that every table computed from votes has."""
CONDITION = ("content", "noise", "demosaic", "level")


def codebook() -> list[dict[str, str]]:
    """Return name, type, unit and description of each column of a table of votes."""
    return table_codebook(COLUMNS)


def misspelt(names: Iterable[object]) -> dict[str, str]:
    """Return {name: column meant} of names that are a column's but for capitals, blanks, hyphens.

    Such a column would be passed over, and what it says of the votes with it. Not where the column
    meant is there as well.
    """
    given = [str(name) for name in names]
    absent = {column.name for column in COLUMNS} - set(given)
    plain = {name: re.sub(r"[\s-]+", "_", name.strip().lower()) for name in given}
    return {name: meant for name, meant in plain.items() if meant in absent}


def spelling_faults(wrong: dict[str, str]) -> dict[str, str]:
    """Return {name: what is wrong} of the names that `misspelt` found."""
    first: dict[str, str] = {}
    return {
        name: f"must be spelled {meant}"
        if first.setdefault(meant, name) == name
        else f"means {meant}, as {first[meant]} does: take one of them out"
        for name, meant in wrong.items()
    }


def complete(votes: pd.DataFrame) -> pd.DataFrame:
    """Return the table with every column of `COLUMNS`, in their types and defaults.

    Raises
    ------
    InputError
        A needed column is missing or misspelt, or a column cannot be brought to its type.
    """
    wrong = spelling_faults(misspelt(votes.columns))
    if wrong:
        raise InputError(Fault(TABLE, name, fact) for name, fact in wrong.items())
    whole = votes.copy()
    for column in COLUMNS:
        if column.required and column.name not in whole:
            raise InputError.of(TABLE, column.name, "column is missing")
        if column.name not in whole:
            whole[column.name] = column.default
        values = whole[column.name]
        if values.dtype == _DTYPES[column.name] and not values.hasnans:
            continue  # as it shall be
        if column.default is not None:
            values = values.where(values.notna(), column.default)
        elif column.filled and values.isna().any():
            raise InputError.of(TABLE, column.name, "is blank in some rows")
        try:
            whole[column.name] = values.astype(DTYPES[column.kind])  # type: ignore[call-overload]  # the stubs want a literal
        except (TypeError, ValueError) as error:
            raise InputError.of(TABLE, column.name, str(error)) from None
    return whole


def scored(votes: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that are scored: valid, of kind test or reference, with a vote."""
    whole = complete(votes)
    return whole[whole["valid"] & whole["kind"].isin(SCORED_KINDS) & whole["vote"].notna()]


def contradictions(votes: pd.DataFrame, low: float, high: float) -> Iterator[tuple[int, str, str]]:
    """Yield (row, column, fact) for every row that contradicts the scale or another row.

    Votes lie in `low`..`high`; among scored votes (lab, observer, stimulus, repetition) is unique,
    and a stimulus has one content, noise, demosaicking, level and kind. `row` is the index.
    """
    outside = votes[(votes["vote"] < low) | (votes["vote"] > high)]
    for row, vote in zip(outside.index, outside["vote"], strict=True):
        yield row, "vote", f"is {vote:g}, must be from {low:g} to {high:g}"
    counting = scored(votes)
    key = ["lab", "observer", "stimulus", "repetition"]
    again = counting[counting.duplicated(key)]
    first = _first_rows(counting, key) if len(again) else {}
    for row, values in zip(again.index, again[key].itertuples(index=False, name=None), strict=True):
        shown = ", ".join(f"{n} {v}" for n, v in zip(key, values, strict=True) if v != "")
        yield row, "observer", f"votes a second time ({shown}); first in row {first[values]}"
    for name in (*CONDITION, "kind"):
        yield from _changed(counting, name)


def _first_rows(votes: pd.DataFrame, key: list[str]) -> dict[tuple[object, ...], int]:
    first = votes.drop_duplicates(key)
    return dict(zip(first[key].itertuples(index=False, name=None), first.index, strict=True))


def _changed(votes: pd.DataFrame, name: str) -> Iterator[tuple[int, str, str]]:
    codes = pd.factorize(votes[name])[0]
    stimulus = pd.factorize(votes["stimulus"])[0]
    __, first = np.unique(stimulus, return_index=True)
    for at in np.flatnonzero(codes != codes[first][stimulus]).tolist():
        origin = int(first[stimulus[at]])
        here, there = _shown(votes[name].iloc[at]), _shown(votes[name].iloc[origin])
        fact = (
            f"of {votes['stimulus'].iloc[at]} is {here}, but {there} in row {votes.index[origin]}"
        )
        yield votes.index[at], name, fact


def _shown(value: object) -> str:
    return "blank" if value in ("", None) or value != value else str(value)  # noqa: PLR0124  nan


@dataclass(frozen=True)
class Indexed:
    """Scored votes as index arrays, for what sums over observers or stimuli.

    Attributes
    ----------
    table
        The scored rows.
    vote
        float64 (vote,): grades.
    stimulus, observer, presentation
        intp (vote,): row of `stimuli`, row of `observers`, number of the (stimulus, repetition).
    stimuli
        `stimulus`, the condition, `kind`, `simulated` (any vote is), by content (hidden references
        last), level, noise, demosaicking (none first) and name.
    observers
        `lab`, `observer`, `simulated`, by name.
    """

    table: pd.DataFrame
    vote: NDArray[np.float64]
    stimulus: NDArray[np.intp]
    observer: NDArray[np.intp]
    presentation: NDArray[np.intp]
    stimuli: pd.DataFrame
    observers: pd.DataFrame

    def per_stimulus(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of `values` (vote,) over each stimulus."""
        return np.bincount(self.stimulus, values, len(self.stimuli)).astype(np.float64)

    def per_observer(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of `values` (vote,) over each observer."""
        return np.bincount(self.observer, values, len(self.observers)).astype(np.float64)


def index_votes(votes: pd.DataFrame) -> Indexed:
    """Return the scored votes as index arrays; raise `InputError` where there are none."""
    table = scored(votes)
    if table.empty:
        raise InputError.of(TABLE, "", "hold no valid vote on a test sequence")
    stimulus, stimuli = _group(table, ["stimulus"], [*CONDITION, "kind"])
    stimuli["hidden"] = stimuli["kind"] == "reference"
    stimuli["mosaicked"] = stimuli["demosaic"] != "none"
    order = ["content", "hidden", "level", "noise", "mosaicked", "demosaic", "stimulus"]
    stimulus, stimuli = _sorted(stimulus, stimuli, order)
    observer, observers = _sorted(*_group(table, ["lab", "observer"], []), ["lab", "observer"])
    repetition = pd.factorize(table["repetition"])[0]
    pairs = stimulus * (int(repetition.max()) + 1) + repetition
    return Indexed(
        table,
        table["vote"].to_numpy(dtype=np.float64),
        stimulus,
        observer,
        np.unique(pairs, return_inverse=True)[1].reshape(-1).astype(np.intp),
        stimuli.drop(columns=["hidden", "mosaicked"]),
        observers,
    )


def _group(
    table: pd.DataFrame, key: list[str], first: list[str]
) -> tuple[NDArray[np.intp], pd.DataFrame]:
    """Return the group of each row, and per group: `key`, the first of `first`, any `simulated`."""
    codes = np.zeros(len(table), dtype=np.intp)
    for name in key:
        mine = pd.factorize(table[name])[0]
        codes = pd.factorize(codes * (int(mine.max()) + 1) + mine)[0]
    leading = np.unique(codes, return_index=True)[1]
    groups = table[[*key, *first]].iloc[leading].reset_index(drop=True)
    robots = np.bincount(codes, table["simulated"].to_numpy(dtype=np.float64))
    return codes, groups.assign(simulated=robots > 0)


def _sorted(
    codes: NDArray[np.intp], groups: pd.DataFrame, order: list[str]
) -> tuple[NDArray[np.intp], pd.DataFrame]:
    """Return groups and the codes of the rows in the natural order of `order`."""
    groups = groups.sort_values(order, key=_natural)
    place = np.empty(len(groups), dtype=np.intp)
    place[groups.index] = np.arange(len(groups))
    return place[codes], groups.reset_index(drop=True)


def _natural(names: pd.Series) -> pd.Series:
    """Pad the numbers in names, so that s2 sorts before s10; leave numbers as they are."""
    if pd.api.types.is_numeric_dtype(names):
        return names
    return names.map(lambda name: re.sub("[0-9]+", lambda digits: digits[0].zfill(12), str(name)))
