"""The contrasts on the latent scale of an ordinal mixed model, with effect sizes."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.inference.contrasts import WHERE_COLUMNS, where
from analysis.inference.design import list_contrasts
from analysis.inference.linear import wald
from analysis.inference.ordinal import Link, OrdinalFit, fit_ordinal
from analysis.table import Column, Kind
from analysis.votes import index_votes

EFFECT_COLUMNS = (
    *WHERE_COLUMNS,
    Column("model", Kind.TEXT, "", "linear, logit or probit: mixed models, observers random"),
    Column("difference", Kind.NUMBER, "", "grades (linear), or units of the latent scale"),
    Column("se", Kind.NUMBER, "", "its standard error"),
    Column("ci_low", Kind.NUMBER, "", "lower end of the 95 % interval, Wald"),
    Column("ci_high", Kind.NUMBER, "", "upper end of the same"),
    Column("p", Kind.NUMBER, "", "two-sided"),
    Column("effect_size", Kind.NUMBER, "sd", "difference over the sd of an observer's votes"),
    Column("superiority", Kind.NUMBER, "", "chance that an observer finds the first better"),
)


@dataclass(frozen=True)
class OrdinalContrasts:
    """Contrasts of an ordinal model.

    Attributes
    ----------
    contrasts
        `question ... level`, `difference, se, ci_low, ci_high, p, effect_size, superiority`.
    fit
        The model; None: nothing could be fitted.
    infinite
        Stimuli whose votes all are the best or all the worst that was given: their place on the
        latent scale is infinite, and contrasts that need them have nan.
    """

    contrasts: pd.DataFrame
    fit: OrdinalFit | None
    infinite: tuple[str, ...]


def ordinal_contrasts(votes: pd.DataFrame, link: Link = "logit") -> OrdinalContrasts:
    """Fit a latent quality per stimulus with random observers, and compare as the contrasts say.

    `effect_size` is the difference over the sd of an observer's repeated votes; `superiority` is
    Phi(effect_size / sqrt 2), the chance that the same observer's latent impression of the first is
    the better one (exact for the probit). Nothing is assumed on the distances between grades.
    """
    scored = index_votes(votes)
    contrasts = list_contrasts(scored)
    where_from = pd.DataFrame(
        [where(c) for c in contrasts], columns=[c.name for c in WHERE_COLUMNS]
    )
    low, high = _ranges(scored.stimulus, scored.vote, len(scored.stimuli))
    at_end = ((low == high) & ((low == low.min()) | (high == high.max()))).astype(np.bool_)
    infinite = tuple(scored.stimuli.loc[at_end, "stimulus"])
    finite = np.flatnonzero(~at_end)
    stays = ~at_end[scored.stimulus]
    fit = None
    if len(finite) > 1 and len(np.unique(scored.vote[stays])) > 1:
        place = np.searchsorted(finite, scored.stimulus[stays])
        dummies = np.eye(len(finite))[place][:, 1:]
        fit = fit_ordinal(scored.vote[stays], dummies, scored.observer[stays], link)
    weights = np.array([c.weights(len(scored.stimuli)) for c in contrasts])
    weights = weights.reshape(-1, len(scored.stimuli))
    return OrdinalContrasts(where_from.assign(**_estimates(fit, weights, finite)), fit, infinite)


def _ranges(
    stimulus: NDArray[np.intp], vote: NDArray[np.float64], stimuli: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest vote on each stimulus."""
    low, high = np.full(stimuli, np.inf), np.full(stimuli, -np.inf)
    np.minimum.at(low, stimulus, vote)
    np.maximum.at(high, stimulus, vote)
    return low, high


def _estimates(
    fit: OrdinalFit | None, weights: NDArray[np.float64], finite: NDArray[np.intp]
) -> dict[str, NDArray[np.float64]]:
    """Return the estimates of contrasts; nan where one needs a stimulus that has none."""
    names = ("difference", "se", "ci_low", "ci_high", "p", "effect_size", "superiority")
    table = {name: np.full(len(weights), np.nan) for name in names}
    if fit is None or not fit.converged:
        return table
    known = np.isclose(np.abs(weights[:, finite]).sum(axis=1), np.abs(weights).sum(axis=1))
    used = weights[np.ix_(known, finite[1:])]  # the first stimulus is the origin of the scale
    found = wald(used @ fit.effects, np.einsum("ij,jk,ik->i", used, fit.effects_covariance, used))
    found["effect_size"] = found["difference"] / fit.latent_sd
    found["superiority"] = ndtr(found["effect_size"] / np.sqrt(2))
    for name, values in found.items():
        table[name][known] = values
    return table


def effect_table(
    linear: pd.DataFrame, residual_sd: float, ordinal: dict[Link, pd.DataFrame]
) -> pd.DataFrame:
    """Return the contrasts of all mixed models, one under the other: columns `EFFECT_COLUMNS`."""
    size = linear["difference"] / residual_sd
    tables = [
        linear.assign(model="linear", effect_size=size, superiority=ndtr(size / np.sqrt(2))),
        *(table.assign(model=link) for link, table in ordinal.items()),
    ]
    return pd.concat(tables, ignore_index=True)[[column.name for column in EFFECT_COLUMNS]]
