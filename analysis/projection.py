"""Alternating projection of P.910, Annex E: the loops, compiled.

Votes stand sorted by stimulus, so that one pass gives the scores and, with each score still at
hand, what is left for the observers.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dsis.compiled import kernel

ROUNDS_MAX = 1000
CONVERGED = 1e-8  # change of the scores, root of the sum of squares, grades
FLOOR = 1e-8  # added to each observer's variance, grades^2: nobody's weight is infinite


class Projection(NamedTuple):
    """Result of `project`.

    Attributes
    ----------
    score, n, variance
        (stimulus,): score, number of votes, population variance of their residuals.
    bias, inconsistency
        (observer,).
    rounds
        Of the iteration.
    converged
        False: stopped after `ROUNDS_MAX`.
    """

    score: NDArray[np.float64]
    n: NDArray[np.int64]
    variance: NDArray[np.float64]
    bias: NDArray[np.float64]
    inconsistency: NDArray[np.float64]
    rounds: int
    converged: bool


def project(
    stimulus: NDArray[np.intp],
    observer: NDArray[np.intp],
    vote: NDArray[np.float64],
    n_observers: int,
) -> Projection:
    """Fit score, bias and inconsistency by alternating projection, from the means on.

    Parameters
    ----------
    stimulus, observer, vote
        (vote,): index of the stimulus (all of 0, 1 ... occur) and of the observer, grade.
    n_observers
        Number of observers, each with a vote.
    """
    order = np.argsort(stimulus, kind="stable")
    n = np.bincount(stimulus)
    starts = np.concatenate([[0], np.cumsum(n)]).astype(np.uintp)
    mine, grade = observer[order].astype(np.uintp), vote[order]
    score, spread = np.zeros(len(n)), np.zeros(len(n))
    bias, variance = np.zeros(n_observers), np.zeros(n_observers)
    rounds, converged = _alternate(starts, mine, grade, score, bias, variance)
    _residual_variance(starts, mine, grade, score, bias, spread)
    return Projection(score, n, spread, bias, np.sqrt(variance), int(rounds), bool(converged))


@kernel
def _alternate(  # noqa: C901 - one loop nest, compiled as one
    starts: Any, observer: Any, vote: Any, score: Any, bias: Any, variance: Any
) -> Any:
    count, left = np.zeros(len(bias)), np.zeros(len(bias))
    for j in range(len(score)):
        total = 0.0
        for k in range(starts[j], starts[j + 1]):
            total += vote[k]
        score[j] = total / (starts[j + 1] - starts[j])
        for k in range(starts[j], starts[j + 1]):
            left[observer[k]] += vote[k] - score[j]
            count[observer[k]] += 1.0
    bias[:] = left / count
    weight = np.ones(len(bias))
    for done in range(1, ROUNDS_MAX + 1):
        # The residuals of each observer have mean zero: bias is the mean of what the score leaves.
        left[:] = 0.0
        for j in range(len(score)):
            for k in range(starts[j], starts[j + 1]):
                i = observer[k]
                residual = vote[k] - score[j] - bias[i]
                left[i] += residual * residual
        variance[:] = left / count
        weight[:] = 1.0 / (variance + FLOOR)
        left[:] = 0.0
        change = 0.0
        for j in range(len(score)):
            total, divisor = 0.0, 0.0
            for k in range(starts[j], starts[j + 1]):
                i = observer[k]
                total += weight[i] * (vote[k] - bias[i])
                divisor += weight[i]
            found = total / divisor
            change += (found - score[j]) ** 2
            score[j] = found
            for k in range(starts[j], starts[j + 1]):
                left[observer[k]] += vote[k] - found
        bias[:] = left / count
        if change < CONVERGED**2:
            return done, True
    return ROUNDS_MAX, False


@kernel
def _residual_variance(
    starts: Any, observer: Any, vote: Any, score: Any, bias: Any, variance: Any
) -> None:
    for j in range(len(score)):
        n = float(starts[j + 1] - starts[j])
        mean = 0.0
        for k in range(starts[j], starts[j + 1]):
            mean += vote[k] - score[j] - bias[observer[k]]
        mean /= n
        squares = 0.0
        for k in range(starts[j], starts[j + 1]):
            squares += (vote[k] - score[j] - bias[observer[k]] - mean) ** 2
        variance[j] = squares / n
