"""DMOS: scores against the hidden reference of the same content."""

import numpy as np
import pandas as pd

from analysis.intervals import default_interval
from analysis.scale import Scale
from analysis.screening import moments
from analysis.table import Column, Kind
from analysis.votes import COLUMNS, CONDITION, index_votes
from dsis.errors import InputError

_VOTE = {column.name: column for column in COLUMNS}
DMOS_COLUMNS = (
    *(_VOTE[name] for name in ("stimulus", *CONDITION)),
    Column("reference", Kind.TEXT, "", "hidden reference of the same content"),
    Column("n", Kind.WHOLE, "observer", "observers who judged both"),
    Column("dmos", Kind.NUMBER, "grade", "mean of vote - vote on the reference + top of the scale"),
    Column("sd", Kind.NUMBER, "grade", "sample standard deviation over observers"),
    Column("ci_low", Kind.NUMBER, "grade", "lower end of the 95 % interval, Student t on pairs"),
    Column("ci_high", Kind.NUMBER, "grade", "upper end of the same; may be above the scale"),
)


def dmos(votes: pd.DataFrame, scale: Scale) -> pd.DataFrame:
    """Return the differential MOS of each stimulus whose content has a hidden reference.

    Each observer's vote minus the same observer's vote on the reference, plus the top of the scale,
    averaged over observers (repetitions first); so bias cancels and the interval is that of pairs.
    Where everybody judged everything it is MOS + top - MOS of the reference (P.910). It exceeds the
    scale where a stimulus is liked better than its reference. Empty without hidden references.

    Raises
    ------
    InputError
        A content has several hidden references.
    """
    scored = index_votes(votes)
    stimuli = scored.stimuli
    references = stimuli[stimuli["kind"] == "reference"]
    twice = references.loc[references.duplicated("content"), "content"]
    if len(twice):
        fact = f"has several hidden references: {', '.join(sorted(set(twice)))}"
        raise InputError.of("votes", "content", fact)
    tests = stimuli[stimuli["kind"] == "test"].merge(
        references[["content", "stimulus"]].rename(columns={"stimulus": "reference"}), on="content"
    )
    if tests.empty:
        return pd.DataFrame(columns=[column.name for column in DMOS_COLUMNS])
    mean = pd.Series(scored.vote).groupby([scored.observer, scored.stimulus]).mean().unstack()  # noqa: PD010 - a matrix is meant
    mean.columns = stimuli["stimulus"]
    pairs = mean[tests["stimulus"]].to_numpy() - mean[tests["reference"]].to_numpy() + scale.high
    observer, stimulus = np.nonzero(~np.isnan(pairs))
    judged, group = np.unique(stimulus, return_inverse=True)
    tests = tests.iloc[judged].reset_index(drop=True)
    n, score, sd = moments(group.reshape(-1).astype(np.intp), pairs[observer, stimulus], 1)
    interval, _ = default_interval(n, score, sd, None)
    table = tests.assign(n=n, dmos=score, sd=sd, ci_low=interval.low, ci_high=interval.high)
    return table[[column.name for column in DMOS_COLUMNS]]
