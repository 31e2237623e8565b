"""Everything that a report shows, computed from a table of votes."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from analysis.hidden_reference import dmos
from analysis.inference import (
    EFFECT_COLUMNS,
    Link,
    conclusions,
    effect_table,
    fit_linear,
    not_comparable,
    ordinal_contrasts,
    test_contrasts,
)
from analysis.likelihood import compare_models
from analysis.order import order_effects
from analysis.rejection import Rejected, propose_rejections
from analysis.repeatability import Retest, retest
from analysis.report.remarks import Counts, Findings, count_votes, remarks
from analysis.scale import Description
from analysis.scores import observer_table, score_table
from analysis.screening import THRESHOLD_SD, remove_outliers, screen_bt500, screen_correlation
from analysis.screens import compare_screens
from analysis.sos import SosFit, sos_parameter
from analysis.votes import index_votes, scored

MODELLED_STIMULI = 60
"""More are not put into the mixed models, which have a parameter for each."""


@dataclass(frozen=True)
class Options:
    """How a report is made.

    Attributes
    ----------
    threshold, passes
        Of the removal of votes: standard deviations, and how often.
    rejected
        Observers whom a person has decided to leave out.
    """

    threshold: float = THRESHOLD_SD
    passes: int = 1
    rejected: tuple[Rejected, ...] = ()


@dataclass(frozen=True)
class Modelled:
    """Mixed models of the contrasts: `effects` has columns `EFFECT_COLUMNS`, perhaps no rows.

    `remarks` say what could not be fitted; `observer_sd` and `residual_sd` are the linear model's.
    """

    effects: pd.DataFrame
    remarks: tuple[str, ...] = ()
    observer_sd: float = np.nan
    residual_sd: float = np.nan


@dataclass(frozen=True)
class Results:
    """Everything that a report shows."""

    counts: Counts
    options: Options
    scores: pd.DataFrame
    dmos: pd.DataFrame
    observers: pd.DataFrame
    screens: pd.DataFrame
    proposal: pd.DataFrame
    removed: pd.DataFrame
    kurtosis: pd.DataFrame
    correlation: pd.DataFrame
    models: pd.DataFrame
    sos: SosFit
    retest: Retest | None
    order: pd.DataFrame
    contrasts: pd.DataFrame
    modelled: Modelled
    conclusions: tuple[str, ...]
    remarks: tuple[str, ...]
    stimuli: tuple[dict[str, object], ...] = field(default=())

    @property
    def p910_degenerate(self) -> bool:
        """Whether P.910's scores are left blank: they rest on the votes of a few observers."""
        return bool(self.scores["score_p910"].isna().any())


def analyse(votes: pd.DataFrame, test: Description, options: Options = Options()) -> Results:
    """Return the tables of a report and its remarks, from a table of votes.

    The votes of `options.rejected` are expected to be left out already (`analysis.reject`).
    """
    counts = count_votes(votes)
    scores = score_table(votes, test.scale, threshold=options.threshold, passes=options.passes)
    observers = observer_table(votes)
    sos, repeated = sos_parameter(votes, test.scale), retest(votes)
    order, contrasts = order_effects(votes), test_contrasts(votes)
    modelled = _model(votes, contrasts)
    findings = Findings(
        sos,
        repeated,
        order,
        modelled.remarks,
        options.rejected,
        options.threshold,
        options.passes,
    )
    return Results(
        counts=counts,
        options=options,
        scores=scores,
        dmos=dmos(votes, test.scale),
        observers=observers,
        screens=compare_screens(votes),
        proposal=propose_rejections(votes),
        removed=remove_outliers(votes, options.threshold, passes=options.passes).removed,
        kurtosis=screen_bt500(votes),
        correlation=screen_correlation(votes),
        models=compare_models(votes),
        sos=sos,
        retest=repeated,
        order=order,
        contrasts=contrasts,
        modelled=modelled,
        conclusions=tuple(conclusions(contrasts)),
        remarks=tuple(remarks(votes, test.scale, counts, scores, observers, findings)),
    )


def _model(votes: pd.DataFrame, contrasts: pd.DataFrame) -> Modelled:
    """Fit the mixed models, where there is something to compare and not too much."""
    nothing = pd.DataFrame(columns=[column.name for column in EFFECT_COLUMNS])
    if contrasts.empty:
        return Modelled(nothing, tuple(not_comparable(index_votes(votes))))
    counts = count_votes(votes)
    if counts.stimuli > MODELLED_STIMULI:
        fact = f"No mixed models: {counts.stimuli} sequences are more than {MODELLED_STIMULI}."
        return Modelled(nothing, (fact,))
    if counts.observers < 2 or scored(votes)["vote"].nunique() < 2:
        return Modelled(nothing, ("No mixed models: they need observers, and votes, that differ.",))
    said: list[str] = []
    linear = fit_linear(votes)
    if not linear.estimable:
        said.append("The linear mixed model leaves nothing to spread: it has no intervals.")
    ordinal: dict[Link, pd.DataFrame] = {}
    links: tuple[Link, ...] = ("logit", "probit")
    for link in links:
        found = ordinal_contrasts(votes, link)
        ordinal[link] = found.contrasts
        if found.fit is None or not found.fit.converged:
            said.append(f"The ordinal mixed model ({link}) has no finite fit.")
    if found.infinite:
        said.append(
            "All votes are the best, or all the worst, on "
            f"{', '.join(found.infinite)}: the ordinal models say nothing of these."
        )
    table = effect_table(linear.contrasts, linear.residual_sd, ordinal)
    return Modelled(table, tuple(said), linear.observer_sd, linear.residual_sd)
