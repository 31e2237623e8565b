"""All screens of observers side by side: who would be rejected by which, and by what numbers."""

import numpy as np
import pandas as pd

from analysis.models import p910, p913
from analysis.screening import BT500, Bt500Rule, screen_bt500, screen_correlation
from analysis.table import Column, Kind
from analysis.votes import COLUMNS, index_votes

LIMIT_SD = 3.0
"""Robust standard deviations: three meet somebody in 4 % of faultless panels of 30."""
_TO_SIGMA = 1.4826  # median absolute deviation to the sd of a normal distribution

_VOTE = {column.name: column for column in COLUMNS}
SCREEN_COLUMNS = (
    _VOTE["lab"],
    _VOTE["observer"],
    Column("method", Kind.TEXT, "", "bt500, p913, correlation or inconsistency"),
    Column("rejected", Kind.FLAG, "", "the method proposes to reject the observer"),
    Column("reason", Kind.TEXT, "", "the numbers"),
)


def screen_inconsistency(votes: pd.DataFrame, limit: float = LIMIT_SD) -> pd.DataFrame:
    """Return for each observer whether P.910's inconsistency is out of the panel's range.

    z = (ln v - median) / (1.4826 median absolute deviation) over the panel, above `limit`:
    rejected. A panel that is all alike (no deviation) rejects nobody.

    Returns
    -------
    DataFrame
        `lab, observer, inconsistency, median, z, rejected`.
    """
    people = p910(votes).observers
    v = people["inconsistency"].to_numpy(dtype=np.float64)
    log_v = np.log(np.maximum(v, np.finfo(np.float64).tiny))
    middle = float(np.median(log_v))
    spread = _TO_SIGMA * float(np.median(np.abs(log_v - middle)))
    z = (log_v - middle) / spread if spread > 0 else np.zeros(len(v))
    table = people[["lab", "observer", "inconsistency"]]
    return table.assign(median=np.exp(middle), z=z, rejected=z > limit)


def compare_screens(votes: pd.DataFrame, rule: Bt500Rule = BT500) -> pd.DataFrame:
    """Return a row per observer and screen: rejected or not, and the numbers; `SCREEN_COLUMNS`."""
    reasons = {
        "bt500": _by_counts(screen_bt500(votes, rule)),
        "p913": _by_counts(p913(votes, rule).observers),
        "correlation": _by_correlation(screen_correlation(votes)),
        "inconsistency": _by_inconsistency(screen_inconsistency(votes)),
    }
    people = index_votes(votes).observers[["lab", "observer"]]
    tables = [
        people.assign(method=method, rejected=found["rejected"], reason=found["reason"])
        for method, found in reasons.items()
    ]
    return pd.concat(tables, ignore_index=True)


def _by_counts(table: pd.DataFrame) -> pd.DataFrame:
    reason = [
        f"P {p}, Q {q}, (P+Q)/n {100 * out:.1f} %"
        + ("" if np.isnan(balance) else f", |P-Q|/(P+Q) {balance:.2f}")
        for p, q, out, balance in zip(
            table["p"], table["q"], table["outside"], table["balance"], strict=True
        )
    ]
    return table.assign(reason=reason)


def _by_correlation(table: pd.DataFrame) -> pd.DataFrame:
    reason = [
        "votes or MOS do not vary" if np.isnan(r) else f"r {r:.2f}, limit {limit:.2f}"
        for r, limit in zip(table["correlation"], table["threshold"], strict=True)
    ]
    return table.assign(reason=reason)


def _by_inconsistency(table: pd.DataFrame) -> pd.DataFrame:
    reason = [
        f"inconsistency {v:.2f}, median {middle:.2f}, z {z:.1f}"
        for v, middle, z in zip(table["inconsistency"], table["median"], table["z"], strict=True)
    ]
    return table.assign(reason=reason)
