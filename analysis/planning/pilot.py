"""Power of a larger test, simulated with scores and observers as a pilot's votes have them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t

from analysis.holm import holm
from analysis.inference.design import CELL, Contrast, list_contrasts, not_comparable
from analysis.planning.leastsquares import Additive, fit_additive
from analysis.scale import Scale
from analysis.table import Column, Kind
from analysis.votes import SIMULATED, Indexed, index_votes
from dsis.errors import InputError

RUNS = 1000
OBSERVERS = (8, 12, 15, 18, 24, 30, 40)
ALPHA = 0.05
SCORES = "least squares"  # the way to scores and spread, as power.csv names it
_ROUNDING = 1 / 12  # variance that rounding to whole grades adds, grades^2

POWER_COLUMNS = (
    Column("comparison", Kind.TEXT, "", "which stimuli"),
    Column("observers", Kind.WHOLE, "observer", "size of the simulated test"),
    Column(
        "difference",
        Kind.NUMBER,
        "grade",
        "mean of the simulated votes; rounding to whole grades and scale ends change it",
    ),
    Column("power", Kind.NUMBER, "", "share of simulated tests that show it: paired t, Holm"),
    Column("power_se", Kind.NUMBER, "", "standard error of that share"),
    replace(SIMULATED, meaning="true: simulated votes are among those of the pilot"),
    Column("scores", Kind.TEXT, "", "how the pilot's scores and spread were found"),
)


def power_from_pilot(
    votes: pd.DataFrame,
    scale: Scale,
    *,
    observers: Sequence[int] = OBSERVERS,
    difference: float | None = None,
    runs: int = RUNS,
    seed: int = 1,
) -> pd.DataFrame:
    """Return power curves: how often tests of so many observers show what the pilot found.

    Score and bias are fitted to the pilot by least squares (`analysis.planning.leastsquares` says
    why not by P.910's likelihood). Simulated observers have the spread of one drawn from the panel
    and a normal bias with the panel's sd; their votes are score + bias + spread X, rounded to whole
    grades where the pilot's are, and kept on the scale. Each simulated test makes all comparisons,
    paired t with Holm at 5 %.

    Parameters
    ----------
    votes, scale
        Of the pilot.
    observers
        Sizes to try, each at least 2.
    difference
        None: the pilot's own pairs of conditions with the differences found there (an optimistic
        choice where the pilot is small: it takes what chance has added for true). Else: each
        sequence against itself shifted down by so many grades, Holm over all, power averaged.
    runs, seed
        Simulated tests per size; what fixes them.

    Returns
    -------
    DataFrame
        Columns `POWER_COLUMNS`.

    Raises
    ------
    InputError
        Fewer than two observers in the pilot, or too few votes to have a spread; a size below two;
        or no pairs of conditions and no `difference`.
    """
    scored = index_votes(votes)
    if len(scored.observers) < 2:
        raise InputError.of("--pilot", "", "holds votes of one observer, must be at least two")
    if min(observers) < 2:
        raise InputError.of("--observers", "", f"is {min(observers)}, must be at least 2")
    found = fit_additive(scored)
    if difference is None:
        pairs = _own_pairs(scored, found.score)
    else:
        pairs = _shifted(found.score, difference)
    panel = _panel(scored, found, scale)
    tables = [
        _simulated(panel, pairs, size, runs, np.random.SeedSequence([seed, size]))
        for size in sorted(set(observers))
    ]
    robots = bool(scored.observers["simulated"].any())
    return pd.concat(tables, ignore_index=True).assign(simulated=robots)


class _Panel(NamedTuple):
    """The fitted observers and the scale.

    `drawn` is the chance of each observer's `spread` to be drawn: an observer counts by the degrees
    of freedom of the spread, so that somebody with few votes is not taken for a consistent one.
    """

    bias_sd: float
    spread: NDArray[np.float64]
    drawn: NDArray[np.float64]
    scale: Scale
    whole: bool


def whole_grades(vote: NDArray[np.float64]) -> bool:
    """Return whether all votes are whole grades: simulated ones are then rounded to such."""
    return bool((vote == np.rint(vote)).all())


class _Pairs(NamedTuple):
    """Scores to compare: (pair,) each, and what to call them."""

    names: list[str]
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    averaged: bool


def _panel(scored: Indexed, found: Additive, scale: Scale) -> _Panel:
    freedom = float(found.freedom.sum())
    if freedom <= 0:
        fact = "has too few votes to tell how far they spread: at least two observers must have "
        raise InputError.of("--pilot", "", f"{fact}judged the same two stimuli")
    drawn = found.freedom / freedom
    variance = np.nan_to_num(found.variance)
    # What a bias is uncertain by is no difference between people.
    noise = float(drawn @ variance) * float((1 / np.bincount(scored.observer)).mean())
    between = max(float(found.bias.var(ddof=1)) - noise, 0.0)
    whole = whole_grades(scored.vote)
    if whole:  # The simulated votes will be rounded too: rounding must not count twice.
        # Off the pooled variance: observer by observer it would be cut at 0 for many, whose share
        # would then stay in the others' spread.
        pooled = float(drawn @ variance)
        variance = variance * (max(pooled - _ROUNDING, 0.0) / pooled if pooled > 0 else 0.0)
    return _Panel(float(np.sqrt(between)), np.sqrt(variance), drawn, scale, whole)


def _own_pairs(scored: Indexed, score: NDArray[np.float64]) -> _Pairs:
    cells = [c for c in list_contrasts(scored) if c.grain == CELL]
    if not cells:
        why = " ".join(not_comparable(scored)).rstrip(".")
        raise InputError.of("--pilot", "", f"{why}: give --difference")
    plus = [cell.plus[0] for cell in cells]
    minus = [cell.minus[0] for cell in cells]
    return _Pairs([_called(cell) for cell in cells], score[plus], score[minus], averaged=False)


def _called(cell: Contrast) -> str:
    stops = f", {cell.level} stops" if cell.level not in ("", "0") else ""
    return f"{cell.treatment}, {cell.content}, {cell.within}{stops}"


def _shifted(score: NDArray[np.float64], difference: float) -> _Pairs:
    down = abs(difference)
    return _Pairs([f"every sequence, {down:g} lower"], score - down, score, averaged=True)


def _simulated(
    panel: _Panel, pairs: _Pairs, size: int, runs: int, seed: np.random.SeedSequence
) -> pd.DataFrame:
    """Return the power of each pair with `size` observers."""
    random = np.random.Generator(np.random.PCG64(seed))
    shown = np.empty((runs, len(pairs.first)), dtype=np.bool_)
    found = np.empty((runs, len(pairs.first)))
    for run in range(runs):
        bias = random.normal(0.0, 1.0, size) * panel.bias_sd
        v = random.choice(panel.spread, size=size, p=panel.drawn)
        sides = [_votes(panel, score, bias, v, random) for score in (pairs.first, pairs.second)]
        paired = sides[0] - sides[1]
        found[run] = paired.mean(axis=1)
        shown[run] = holm(_paired_p(paired)) <= ALPHA
    if pairs.averaged:
        shown_share, difference = shown.mean(axis=1, keepdims=True), found.mean()
    else:
        shown_share, difference = shown.astype(np.float64), found.mean(axis=0)
    power = shown_share.mean(axis=0)
    return pd.DataFrame(
        {
            "comparison": pairs.names,
            "observers": size,
            "difference": difference,
            "power": power,
            "power_se": shown_share.std(axis=0) / np.sqrt(runs),
            "scores": SCORES,
        }
    )


def _votes(
    panel: _Panel,
    score: NDArray[np.float64],
    bias: NDArray[np.float64],
    v: NDArray[np.float64],
    random: np.random.Generator,
) -> NDArray[np.float64]:
    """Return votes, (stimulus, observer)."""
    votes = score[:, None] + bias + v * random.standard_normal((len(score), len(v)))
    if panel.whole:
        votes = np.rint(votes)
    return np.asarray(np.clip(votes, panel.scale.low, panel.scale.high), dtype=np.float64)


def _paired_p(paired: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the p-values of paired t tests along observers; where all differ alike: 0 or 1."""
    n = paired.shape[1]
    mean, sd = paired.mean(axis=1), paired.std(axis=1, ddof=1)
    flat = sd <= 1e-12
    statistic = np.divide(np.abs(mean), sd / np.sqrt(n), out=np.zeros_like(mean), where=~flat)
    p = 2 * t.sf(statistic, n - 1)
    return np.asarray(np.where(flat, (mean == 0).astype(np.float64), p), dtype=np.float64)
