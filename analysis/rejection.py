"""Rejecting observers: screens propose, a person accepts, and only then are votes left out."""

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from analysis.screens import SCREEN_COLUMNS, compare_screens
from analysis.table import Column, Kind
from analysis.votes import complete, index_votes
from dsis.errors import Fault, InputError

PROPOSAL_COLUMNS = (
    *SCREEN_COLUMNS[:2],
    Column("methods", Kind.TEXT, "", "screens that would reject the observer"),
    Column("reason", Kind.TEXT, "", "their numbers"),
    Column("accept", Kind.FLAG, "", "set to true to leave the observer out", default=False),
)


@dataclass(frozen=True, order=True)
class Rejected:
    """An observer to leave out; `lab` is empty where there is one laboratory."""

    lab: str
    observer: str
    simulated: bool = field(default=False, compare=False)

    def __str__(self) -> str:
        return f"{self.lab}/{self.observer}" if self.lab else self.observer


def propose_rejections(votes: pd.DataFrame) -> pd.DataFrame:
    """Return the observers that any screen would reject, `PROPOSAL_COLUMNS`; `accept` is false."""
    screens = compare_screens(votes)
    found = screens[screens["rejected"].astype(bool)]
    table = (
        found.groupby(["lab", "observer"], sort=True)
        .agg(
            methods=("method", "; ".join),
            reason=("reason", lambda reasons: "; ".join(dict.fromkeys(reasons))),
        )
        .reset_index()
    )
    return table.assign(accept=False)


def keep_decisions(proposal: pd.DataFrame, decided: Iterable[Rejected]) -> pd.DataFrame:
    """Return `proposal` after the decisions taken: a report made again keeps them."""
    rows = [(one.lab, one.observer, "", "left out by decision", True) for one in decided]
    names = [column.name for column in PROPOSAL_COLUMNS]
    return pd.concat([pd.DataFrame(rows, columns=names), proposal[names]], ignore_index=True)


def reject(
    votes: pd.DataFrame, observers: Iterable[str], accepted: Iterable[str] = ()
) -> tuple[pd.DataFrame, list[Rejected]]:
    """Return the votes without those of `observers`, and who was left out.

    Parameters
    ----------
    votes
        Table of votes.
    observers
        Names; `lab/name` where a name stands in several laboratories.
    accepted
        More of them, from a file of decisions (`read_accepted`): faults are named so.

    Raises
    ------
    InputError
        A name is no observer's, or several observers', or nobody would be left.
    """
    whole = complete(votes)
    people = index_votes(whole).observers[["lab", "observer", "simulated"]]
    known = [Rejected(*person) for person in people.itertuples(index=False, name=None)]
    faults, chosen = [], set()
    given = dict.fromkeys(accepted, "--accept") | dict.fromkeys(observers, "--reject")
    for name, option in given.items():
        matches = [one for one in known if name in (one.observer, f"{one.lab}/{one.observer}")]
        exact = [one for one in matches if name == str(one)]
        matches = exact if len(exact) == 1 else matches
        if len(matches) == 1:
            chosen.add(matches[0])
        elif matches:
            both = ", ".join(map(str, matches))
            faults.append(Fault(option, name, f"is several observers: give one of {both}"))
        else:
            faults.append(Fault(option, name, "is no observer who cast a scored vote"))
    if not faults and len(chosen) == len(known):
        faults.append(
            Fault(
                " and ".join(sorted(set(given.values()))),
                "",
                "leaves nobody: all observers are rejected",
            )
        )
    if faults:
        raise InputError(faults)
    mine = list(zip(whole["lab"], whole["observer"], strict=True))
    gone = {(one.lab, one.observer) for one in chosen}
    stays = [person not in gone for person in mine]
    return whole[stays], sorted(chosen)


def read_accepted(path: Path) -> list[str]:
    """Return the observers accepted in an edited `rejections.csv`: rows with `accept` true.

    Raises
    ------
    InputError
        The file cannot be read, or is no such table.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is not UTF-8 text"
        raise InputError.of(path, "", f"cannot be read: {reason}") from None
    header = text.split("\n", 1)[0]
    rows = csv.DictReader(io.StringIO(text, newline=""), delimiter=";" if ";" in header else ",")
    missing = {"observer", "accept"} - set(rows.fieldnames or ())
    if missing:
        raise InputError.of(path, ", ".join(sorted(missing)), "is missing (column)")
    accept = PROPOSAL_COLUMNS[-1]
    accepted, faults = [], []
    for row in rows:
        try:
            if accept.parse((row["accept"] or "").strip()):
                accepted.append(str(Rejected(row.get("lab") or "", row["observer"])))
        except ValueError as error:
            faults.append(Fault(str(path), f"row {rows.line_num}, accept", str(error)))
    if faults:
        raise InputError(faults)
    return accepted
