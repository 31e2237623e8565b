"""What the order of presentations does to votes: drift, fatigue, and what was seen just before."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t

from analysis.holm import holm
from analysis.screening import moments
from analysis.table import Column, Kind
from analysis.votes import Indexed, index_votes

FEW_PER_OBSERVER = 5  # votes; fewer give no slope worth averaging
STEP = 10  # presentations
ORDER_COLUMNS = (
    Column("effect", Kind.TEXT, "", "drift, fatigue or contrast"),
    Column("meaning", Kind.TEXT, "", "what the slope is"),
    Column("observers", Kind.WHOLE, "observer", "observers with a slope of their own"),
    Column("slope", Kind.NUMBER, "grade", "mean of their slopes"),
    Column("ci_low", Kind.NUMBER, "grade", "lower end of its 95 % interval, Student t"),
    Column("ci_high", Kind.NUMBER, "grade", "upper end of the same"),
    Column("p", Kind.NUMBER, "", "two-sided, slope 0"),
    Column("p_holm", Kind.NUMBER, "", "after Holm, over the effects of this table"),
)
_MEANINGS = {
    "drift": f"vote above that of the others, per {STEP} presentations",
    "fatigue": f"distance of the vote from that of the others, per {STEP} presentations",
    "contrast": "vote above that of the others, per grade of MOS of the one before",
}


def order_effects(votes: pd.DataFrame) -> pd.DataFrame:
    """Return drift, fatigue and contrast: each observer's slope, averaged over observers.

    The residual of a vote is its distance from the stimulus' mean and the observer's own mean
    residual. Drift is the slope of the residual on the place in the observer's order; fatigue that
    of its absolute value; contrast that of the residual on the MOS of the presentation just
    before. As everyone has an order of one's own, stimuli and places are not confounded.

    Returns
    -------
    DataFrame
        Columns `ORDER_COLUMNS`; empty where the votes carry no `presentation`, or fewer than two
        observers have `FEW_PER_OBSERVER` votes.
    """
    scored = index_votes(votes)
    place = scored.table["presentation"].to_numpy(dtype=np.float64, na_value=np.nan)
    residual, before = _residual(scored), _before(scored, place)
    sides = {
        "drift": (place / STEP, residual),
        "fatigue": (place / STEP, np.abs(residual)),
        "contrast": (before, residual),
    }
    rows = []
    for effect, (x, y) in sides.items():
        slopes = _slopes(scored, x, y)
        if len(slopes) > 1:
            rows.append((effect, _MEANINGS[effect], len(slopes), *_mean_slope(slopes)))
    table = pd.DataFrame(rows, columns=[column.name for column in ORDER_COLUMNS[:-1]])
    return table.assign(p_holm=holm(table["p"].to_numpy(dtype=np.float64)))


def residuals(votes: pd.DataFrame) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (place in the observer's order, nan: not known; residual) of each scored vote."""
    scored = index_votes(votes)
    place = scored.table["presentation"].to_numpy(dtype=np.float64, na_value=np.nan)
    return np.asarray(place, dtype=np.float64), _residual(scored)


def _residual(scored: Indexed) -> NDArray[np.float64]:
    off = scored.vote - moments(scored.stimulus, scored.vote, 1).mean[scored.stimulus]
    bias = scored.per_observer(off) / np.bincount(scored.observer)
    return np.asarray(off - bias[scored.observer])


def _before(scored: Indexed, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the MOS of the stimulus one place earlier in the observer's order; nan: none."""
    mos = moments(scored.stimulus, scored.vote, 1).mean[scored.stimulus]
    shown = pd.Series(mos, index=pd.MultiIndex.from_arrays([scored.observer, place]))
    shown = shown[~shown.index.duplicated() & ~np.isnan(place)]
    wanted = pd.MultiIndex.from_arrays([scored.observer, place - 1])
    return np.asarray(shown.reindex(wanted), dtype=np.float64)


def _slopes(scored: Indexed, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least-squares slope of each observer who has enough votes and spread in x."""
    known = ~np.isnan(x)
    x, y, who = x[known], y[known], scored.observer[known]
    n = np.bincount(who, minlength=len(scored.observers))
    divisor = np.maximum(n, 1)
    x = x - (np.bincount(who, x, len(n)) / divisor)[who]
    y = y - (np.bincount(who, y, len(n)) / divisor)[who]
    squares = np.bincount(who, x * x, len(n))
    enough = (n >= FEW_PER_OBSERVER) & (squares > 0)
    products = np.bincount(who, x * y, len(n))
    return np.asarray(products[enough] / squares[enough], dtype=np.float64)


def _mean_slope(slopes: NDArray[np.float64]) -> tuple[float, float, float, float]:
    n, mean = len(slopes), float(slopes.mean())
    se = float(slopes.std(ddof=1)) / np.sqrt(n)
    half = t.ppf(0.975, n - 1) * se
    p = 2 * t.sf(abs(mean) / se, n - 1) if se > 0 else float(mean == 0)
    return mean, mean - half, mean + half, float(p)
