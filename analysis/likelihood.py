"""Which model describes the votes best: log-likelihood, AIC and BIC of each."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.models import p910, p913
from analysis.screening import BT500, Bt500Rule, moments, screen_bt500
from analysis.table import Column, Kind
from analysis.votes import Indexed, index_votes

MODEL_COLUMNS = (
    Column("model", Kind.TEXT, "", "MOS, BT.500, BR (bias removed), P.913 or P.910"),
    Column("parameters", Kind.WHOLE, "", "free parameters"),
    Column("votes", Kind.WHOLE, "vote", "votes it describes: screening leaves some out"),
    Column("loglik_per_vote", Kind.NUMBER, "nat", "log-likelihood over the number of these votes"),
    Column("aic_per_vote", Kind.NUMBER, "nat", "Akaike's criterion, over the number of all votes"),
    Column("bic_per_vote", Kind.NUMBER, "nat", "Bayes' criterion; smaller is better"),
)


def compare_models(votes: pd.DataFrame, rule: Bt500Rule = BT500) -> pd.DataFrame:
    """Return log-likelihood, AIC and BIC per vote of the observer models.

    MOS: a mean and a sd per stimulus, 2 J parameters. BT.500: the same, of the observers who pass.
    BR: the same after the observers' bias, 2 J + I; P.913: of those who pass. P.910: a score per
    stimulus, bias and inconsistency per observer, J + 2 I. Models compare on the same votes: MOS,
    BR and P.910 do; screening makes its model better by leaving out what does not fit. A stimulus
    on which all agree has no density under a sd of its own and adds nothing there; nor does, in
    P.910, a panel that agrees but for biases. Where P.910's fit is degenerate its likelihood has no
    bound: blank.

    Parameters
    ----------
    votes
        Table of votes.
    rule
        How BT.500's screening counts.

    Returns
    -------
    DataFrame
        Columns `MODEL_COLUMNS`.
    """
    scored = index_votes(votes)
    j, i = len(scored.stimuli), len(scored.observers)
    everybody = np.zeros(i, dtype=np.bool_)
    by_kurtosis = screen_bt500(votes, rule)["rejected"].to_numpy(dtype=np.bool_)
    unbiased = p913(votes, rule).observers
    corrected = scored.vote - unbiased["bias"].to_numpy()[scored.observer]
    after_bias = unbiased["rejected"].to_numpy(dtype=np.bool_)
    rows = [
        ("MOS", 2 * j, *_spread_by_stimulus(scored, scored.vote, everybody)),
        ("BT.500", 2 * j, *_spread_by_stimulus(scored, scored.vote, by_kurtosis)),
        ("BR", 2 * j + i, *_spread_by_stimulus(scored, corrected, everybody)),
        ("P.913", 2 * j + i, *_spread_by_stimulus(scored, corrected, after_bias)),
        ("P.910", j + 2 * i, *_spread_by_observer(votes, scored)),
    ]
    table = pd.DataFrame(rows, columns=["model", "parameters", "votes", "loglik_per_vote"])
    per_vote = table["parameters"] / len(scored.vote)
    table["aic_per_vote"] = 2 * per_vote - 2 * table["loglik_per_vote"]
    table["bic_per_vote"] = np.log(len(scored.vote)) * per_vote - 2 * table["loglik_per_vote"]
    return table


def _spread_by_stimulus(
    scored: Indexed, vote: NDArray[np.float64], rejected: NDArray[np.bool_]
) -> tuple[int, float]:
    """Return number and mean log-density of the votes kept: each stimulus its mean and sd."""
    stays = ~rejected[scored.observer]
    if not stays.any():
        return 0, np.nan
    group = np.unique(scored.stimulus[stays], return_inverse=True)[1].reshape(-1)
    _, mean, sd = moments(group.astype(np.intp), vote[stays], 1)
    density = _log_density(vote[stays] - mean[group], sd[group])
    return int(stays.sum()), float(density.sum() / stays.sum())


def _spread_by_observer(votes: pd.DataFrame, scored: Indexed) -> tuple[int, float]:
    fit = p910(votes)
    if fit.degenerate:
        return len(scored.vote), np.nan
    score, people = fit.scores["score"].to_numpy(), fit.observers
    bias = people["bias"].to_numpy()
    spread = people["inconsistency"].where(~people["rigid"], 0.0).to_numpy()
    residual = scored.vote - score[scored.stimulus] - bias[scored.observer]
    return len(scored.vote), float(_log_density(residual, spread[scored.observer]).mean())


def _log_density(residual: NDArray[np.float64], sd: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the normal log-density; 0 where there is no spread, or none is known."""
    known = sd > 0
    z = np.divide(residual, sd, out=np.zeros_like(sd), where=known)
    log_sd = np.log(sd, out=np.zeros_like(sd), where=known)
    return np.where(known, -0.5 * np.log(2 * np.pi) - log_sd - 0.5 * z**2, 0.0)
