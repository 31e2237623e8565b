"""Scores: mean opinion score with its interval, and the two tables that a test ends in."""

import numpy as np
import pandas as pd

from analysis.bootstrap import bootstrap_scores
from analysis.intervals import binomial_interval, default_interval
from analysis.models import MaximumLikelihood, p910, p913, scores_of
from analysis.scale import Scale
from analysis.screening import (
    THRESHOLD_SD,
    moments,
    remove_outliers,
    screen_bt500,
    screen_correlation,
)
from analysis.table import Column, Kind
from analysis.votes import COLUMNS, CONDITION, SIMULATED, index_votes

_VOTE = {column.name: column for column in COLUMNS}


def _score(name: str, meaning: str) -> Column:
    return Column(name, Kind.NUMBER, "grade", meaning)


MOS_COLUMNS = (
    *(_VOTE[name] for name in ("stimulus", *CONDITION)),
    Column("n", Kind.WHOLE, "vote", "votes scored: valid, on test sequences"),
    _score("mos", "mean of all scored votes"),
    _score("sd", "sample standard deviation of all scored votes"),
    _score("ci_low", "lower end of the 95 % interval of mos, Student t, n - 1 (see ci_method)"),
    _score("ci_high", "upper end of the same"),
    Column("n_removed", Kind.WHOLE, "vote", "votes removed as outliers of their stimulus"),
    _score("mos_trimmed", "mean of the votes kept"),
    _score("sd_trimmed", "sample standard deviation of the votes kept"),
    _score("ci_trimmed_low", "lower end of their nominal 95 % interval, as ci_low; too narrow"),
    _score("ci_trimmed_high", "upper end of the same"),
    _score("mos_bt500", "mean over the observers that BT.500's screening accepts"),
    _score("mos_p913", "mean after bias removal (P.913, 12.4), then BT.500's screening"),
    _score(
        "score_p910",
        "maximum-likelihood score (P.910, Annex E); blank where it leans on one observer",
    ),
    _score("p910_ci_low", "lower end of its 95 % interval"),
    _score("p910_ci_high", "upper end of the same"),
    SIMULATED,
    Column("kind", Kind.TEXT, "", "test, or reference: a hidden reference"),
    Column("ci_method", Kind.TEXT, "", "of ci_low: t; binomial where all agree; none"),
    _score("ci_binomial_low", "lower end of the 95 % interval by Clopper-Pearson, conservative"),
    _score("ci_binomial_high", "upper end of the same; never leaves the scale"),
    _score("ci_boot_low", "lower end, bootstrap over observers of the mean of all votes"),
    _score("ci_boot_high", "upper end of the same"),
    _score("ci_boot_trimmed_low", "lower end, of mos_trimmed: the removal inside each resample"),
    _score("ci_boot_trimmed_high", "upper end of the same"),
)
OBSERVER_COLUMNS = (
    _VOTE["observer"],
    Column("n", Kind.WHOLE, "vote", "votes scored"),
    _score("bias", "how far above the others the observer votes (P.910)"),
    _score("inconsistency", "sd of the observer's votes about score + bias (P.910)"),
    Column("bt500_p", Kind.WHOLE, "vote", "votes far above the mean (BT.500)"),
    Column("bt500_q", Kind.WHOLE, "vote", "votes far below the mean (BT.500)"),
    Column("bt500_rejected", Kind.FLAG, "", "(p + q) / n > 0.05 and |p - q| / (p + q) < 0.3"),
    Column("correlation", Kind.NUMBER, "", "smaller of Pearson's and Spearman's, votes with mos"),
    Column("correlation_rejected", Kind.FLAG, "", "at most min(0.7, mean - sd over the observers)"),
    SIMULATED,
    _VOTE["lab"],
)


def mos(votes: pd.DataFrame, scale: Scale | None = None) -> pd.DataFrame:
    """Return the mean opinion score of each stimulus with its 95 % interval.

    mos +- t(0.975, n - 1) sd / sqrt(n), sd with n - 1; over valid votes of kind test or reference.
    The interval may leave the scale. Where all votes agree, or there is a single one, it is
    Clopper-Pearson's if the scale is given; else it has no width, or is nan.

    Parameters
    ----------
    votes
        Table of votes (`analysis.read_votes`).
    scale
        Of the test.

    Returns
    -------
    DataFrame
        `stimulus, content, noise, demosaic, level, n, mos, sd, ci_low, ci_high, ci_method` (t,
        binomial or none), sorted by content, level, noise and demosaicking.
    """
    scored = index_votes(votes)
    n, mean, sd = moments(scored.stimulus, scored.vote, 1)
    interval, method = default_interval(n, mean, sd, scale)
    return scored.stimuli[["stimulus", *CONDITION]].assign(
        n=n, mos=mean, sd=sd, ci_low=interval.low, ci_high=interval.high, ci_method=method
    )


def score_table(
    votes: pd.DataFrame,
    scale: Scale | None = None,
    *,
    threshold: float = THRESHOLD_SD,
    passes: int = 1,
) -> pd.DataFrame:
    """Return one row a stimulus with all scores: the table `mos.csv`, columns `MOS_COLUMNS`.

    Parameters
    ----------
    votes, scale
        As for `mos`; without a scale there are no binomial intervals.
    threshold, passes
        Of the removal of votes, as for `analysis.remove_outliers`.
    """
    scored = index_votes(votes)
    raw = mos(votes, scale)
    trimmed = mos(remove_outliers(votes, threshold, passes=passes).kept, scale)
    rejected = screen_bt500(votes)["rejected"].to_numpy(dtype=np.bool_)
    likelihood = _usable(p910(votes))
    table = raw.assign(
        n_removed=raw["n"] - trimmed["n"],
        mos_trimmed=trimmed["mos"],
        sd_trimmed=trimmed["sd"],
        ci_trimmed_low=trimmed["ci_low"],
        ci_trimmed_high=trimmed["ci_high"],
        mos_bt500=scores_of(scored, scored.vote, rejected)["score"],
        mos_p913=p913(votes).scores["score"],
        score_p910=likelihood["score"],
        p910_ci_low=likelihood["ci_low"],
        p910_ci_high=likelihood["ci_high"],
        simulated=scored.stimuli["simulated"],
        kind=scored.stimuli["kind"],
        ci_binomial_low=np.nan,
        ci_binomial_high=np.nan,
    )
    if scale is not None:
        binomial = binomial_interval(table["n"], table["mos"], scale)
        table = table.assign(ci_binomial_low=binomial.low, ci_binomial_high=binomial.high)
    for name, limit in (("ci_boot", None), ("ci_boot_trimmed", threshold)):
        drawn = bootstrap_scores(votes, threshold=limit, passes=passes)
        table = table.assign(
            **{f"{name}_low": drawn["boot_low"], f"{name}_high": drawn["boot_high"]}
        )
    return table[[column.name for column in MOS_COLUMNS]]


def _usable(fit: MaximumLikelihood) -> pd.DataFrame:
    """Return the scores, blank where they rest on somebody's votes alone and mean nothing."""
    if not fit.degenerate:
        return fit.scores
    return fit.scores.assign(**dict.fromkeys(("score", "ci_low", "ci_high"), np.nan))


def observer_table(votes: pd.DataFrame) -> pd.DataFrame:
    """Return one row an observer: the table `observers.csv`, columns `OBSERVER_COLUMNS`."""
    scored = index_votes(votes)
    fitted = p910(votes).observers
    kurtosis = screen_bt500(votes)
    agreement = screen_correlation(votes)
    table = fitted[["lab", "observer", "n", "bias", "inconsistency"]].assign(
        bt500_p=kurtosis["p"],
        bt500_q=kurtosis["q"],
        bt500_rejected=kurtosis["rejected"],
        correlation=agreement["correlation"],
        correlation_rejected=agreement["rejected"],
        simulated=scored.observers["simulated"],
    )
    return table[[column.name for column in OBSERVER_COLUMNS]]
