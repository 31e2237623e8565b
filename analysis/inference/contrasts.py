"""Paired tests of contrasts: every observer is compared with himself."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t

from analysis.holm import holm
from analysis.inference.design import Contrast, list_contrasts
from analysis.inference.signedrank import signed_rank
from analysis.table import Column, Kind
from analysis.votes import Indexed, index_votes

WHERE_COLUMNS = (
    Column("question", Kind.TEXT, "", "demosaicking or noise"),
    Column("treatment", Kind.TEXT, "", "what is compared with what"),
    Column("grain", Kind.TEXT, "", "cell: one pair; content: its pairs averaged; overall: all"),
    Column("content", Kind.TEXT, "", "content, or all"),
    Column("within", Kind.TEXT, "", "the factor held: noise, or demosaicking; or all"),
    Column("level", Kind.TEXT, "stop", "stops of under-exposure, or all"),
)
CONTRAST_COLUMNS = (
    *WHERE_COLUMNS,
    Column("n", Kind.WHOLE, "observer", "observers who judged all stimuli of the contrast"),
    Column("difference", Kind.NUMBER, "grade", "mean over observers; negative: lowers the score"),
    Column("sd", Kind.NUMBER, "grade", "sample standard deviation of the observers' differences"),
    Column("ci_low", Kind.NUMBER, "grade", "lower end of the 95 % interval, Student t on pairs"),
    Column("ci_high", Kind.NUMBER, "grade", "upper end of the same"),
    Column("effect_size", Kind.NUMBER, "sd", "difference / sd (Cohen's d of pairs)"),
    Column("p_t", Kind.NUMBER, "", "paired t test, two-sided"),
    Column("p_t_holm", Kind.NUMBER, "", "after Holm, over the rows of one grain and question"),
    Column("p_wilcoxon", Kind.NUMBER, "", "signed-rank test, exact, zeros by Pratt"),
    Column("p_wilcoxon_holm", Kind.NUMBER, "", "after Holm, over the same rows"),
)


def test_contrasts(votes: pd.DataFrame) -> pd.DataFrame:
    """Test every contrast within observers: paired t and Wilcoxon's signed-rank, Holm-adjusted.

    An observer's value is the weighted sum of the means of his votes. Only observers who judged all
    stimuli of a contrast count. Holm's family are the rows of one question and grain: all pairs, or
    all contents.

    Returns
    -------
    DataFrame
        Columns `CONTRAST_COLUMNS`; empty where the stimuli name no conditions.
    """
    scored = index_votes(votes)
    means = observer_means(scored)
    rows = []
    for contrast in list_contrasts(scored):
        used = np.unique([*contrast.plus, *contrast.minus])
        mine = means[:, used] @ contrast.weights(means.shape[1])[used]
        rows.append((*where(contrast), *_paired(mine[~np.isnan(mine)])))
    names = [c.name for c in CONTRAST_COLUMNS if not c.name.endswith("_holm")]
    table = pd.DataFrame(rows, columns=names)
    for test in ("p_t", "p_wilcoxon"):
        table[f"{test}_holm"] = np.nan
        for _, family in table.groupby(["question", "grain"]):
            adjusted = holm(family[test].to_numpy(dtype=np.float64))
            table.loc[family.index, f"{test}_holm"] = adjusted
    return table[[column.name for column in CONTRAST_COLUMNS]]


test_contrasts.__test__ = False  # type: ignore[attr-defined]  # pytest would take it for a test


def observer_means(scored: Indexed) -> NDArray[np.float64]:
    """Return the mean vote of each observer on each stimulus, (observer, stimulus); nan: none."""
    shape = (len(scored.observers), len(scored.stimuli))
    cell = scored.observer * shape[1] + scored.stimulus
    n = np.bincount(cell, minlength=shape[0] * shape[1])
    total = np.bincount(cell, scored.vote, minlength=len(n))
    mean = np.divide(total, n, out=np.full(len(n), np.nan), where=n > 0)
    return np.asarray(mean.reshape(shape), dtype=np.float64)


def where(contrast: Contrast) -> tuple[str, ...]:
    """Return the cells of `WHERE_COLUMNS`."""
    return (
        contrast.question,
        contrast.treatment,
        contrast.grain,
        contrast.content,
        contrast.within,
        contrast.level,
    )


def _paired(difference: NDArray[np.float64]) -> tuple[float, ...]:
    """Return n, mean, sd, interval, effect size, p of the t test and of the signed-rank test."""
    n = len(difference)
    if n < 2:
        mean = float(difference.mean()) if n else np.nan
        return (n, mean, *[np.nan] * 6)
    mean, sd = float(difference.mean()), float(difference.std(ddof=1))
    se = sd / np.sqrt(n)
    half = float(t.ppf(0.975, n - 1)) * se
    # Where all differ by the same, t has no denominator: no test, and no interval.
    alike = np.ptp(difference) <= 1e-9 * max(abs(mean), 1.0)
    rank = signed_rank(difference)
    if alike:
        return n, mean, 0.0, np.nan, np.nan, np.nan, np.nan, rank
    p = float(2 * t.sf(abs(mean) / se, n - 1))
    return n, mean, sd, mean - half, mean + half, mean / sd, p, rank
