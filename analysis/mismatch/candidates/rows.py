"""Offsets that neighbouring rows share: bands without a frequency."""

from collections.abc import Sequence
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.bank.linelags import LINE_LAGS
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout
from dsis.effects import Effect

Array = NDArray[np.float64]
_SHARED = 0.25  # of an offset, by the next row: rows that share less are as good as white
_MOST = 1 / 4  # of the frame's rows: what lasts longer looks as a drift does
_CLEAR = 3.0  # standard deviations of the correlation of row means
_LENGTHS = 24  # tried, in equal ratios


def _row_banding(clues: Clues) -> Sequence[Proposal]:
    """Start from the length whose correlations are nearest to the recorded ones."""
    left, sd = np.transpose([_left(clues, lag) for lag in LINE_LAGS])
    known = np.isfinite(sd)
    shortest, longest = _shortest(), _longest(clues.layout)
    if not known.any() or longest <= shortest:
        return []
    lags, left, sd = np.array(LINE_LAGS)[known], left[known], sd[known]
    lengths = np.geomspace(shortest, longest, _LENGTHS)
    shapes = np.exp(-lags / lengths[:, np.newaxis]) / sd
    squares = (shapes**2).sum(1)
    along = shapes @ (left / sd) / np.sqrt(squares)  # in standard deviations, of each length
    best = int(along.argmax())
    if along[best] < _CLEAR:
        return []
    share = along[best] / sqrt(squares[best])
    sigma = sqrt(share * _row_mean_variance(clues))
    free, length = ["sigma_dn", "length_rows"], float(lengths[best])
    return [
        one
        for size in (sigma, sigma / 2)  # of few frames twice too large is no rare start
        for one in proposals("row_banding", free, sigma_dn=size, length_rows=length)
    ]


def _left(clues: Clues, lag: int) -> tuple[float, float]:
    """Return by how much row means correlate beyond the model, and its standard deviation."""
    for i, key in enumerate(clues.vector.keys):
        wanted = key.statistic == "row_correlation" and key.detail == f"lag {lag}"
        if wanted and clues.null.known[i]:
            mean, sd = float(clues.null.mean[i]), float(clues.null.sd[i])
            return float(clues.vector.values[i]) - mean, sd
    return 0.0, np.inf


def _row_mean_variance(clues: Clues) -> float:
    """Return the temporal variance of row means where pixels are quietest, DN^2.

    Of whole rows: two channels of a mosaic share one, and what they have in common.
    """
    place = min(clues.places, key=lambda p: clues.seen.levels[p].variance_dn2)
    ratio, _ = clues.seen.scalars[place]["row_variance"]
    variance = clues.seen.levels[place].variance_dn2
    common = variance / clues.shape(place[1])[1] * max(ratio**3 - 1, 0.0)
    white = variance / clues.layout.columns
    return white + common if np.isfinite(ratio) else white


def _shortest() -> float:
    return 1 / log(1 / _SHARED)


def _longest(layout: Layout) -> float:
    return _MOST * layout.rows


def _sane(layout: Layout, effect: Effect) -> bool:
    """Return whether rows share what they do over more than a row, and over part of the frame."""
    length = float(effect.model_dump()["length_rows"])
    return _shortest() <= length <= _longest(layout)


CANDIDATES = (
    Candidate(
        "row_banding",
        ("row_correlation", "slow_row_variance", "row_variance"),
        _row_banding,
        sane=_sane,
        credited=frozenset({"row_noise"}),
    ),
)
