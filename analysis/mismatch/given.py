"""What further frames add to the odds of an effect, once what was seen before is given.

The numbers of all frames are summed with the weights that see an effect best, their change over
their variance (Fisher 1936), and so are the numbers of the frames before. Such a sum is a score,
and what further frames add to a score does not depend on what it was before: its regression on the
score before is 1. So what the difference of both says is new, and an effect that was fitted to the
noise of the frames before gains nothing by it.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.stats
from numpy.typing import NDArray

Array = NDArray[np.float64]
CHANCE = 0.025  # of recordings without an effect show as much as is called certain
_BEYOND = 4.0  # standard deviations beyond what both models expect: further ones count no more
_PRIOR = 4.0  # numbers of their closed-form error that a scale is worth beforehand
_LEAST_SCALE = 0.8


@dataclass(frozen=True)
class Numbers:
    """Numbers of one set of frames.

    Attributes
    ----------
    recorded
        (number,); nan where unknown.
    one, other
        Of recordings simulated with an effect and without it, on the same draws: (recording,
        number).
    errors
        Standard deviations in white noise, (number,).
    """

    recorded: Array
    one: Array
    other: Array
    errors: Array

    @property
    def known(self) -> NDArray[np.bool_]:
        """Which numbers can be summed."""
        values = np.vstack([self.recorded, self.one, self.other, self.errors])
        return np.asarray(np.isfinite(values).all(0) & (self.errors > 0))


@dataclass(frozen=True)
class Ratio:
    """Log-likelihood ratio of the further frames, with an effect against without, nats.

    Attributes
    ----------
    nats, error
        As recorded, and its standard deviation where the effect is there.
    certain
        Whether it favours the effect, and `CHANCE` is ruled out.
    """

    nats: float
    error: float
    certain: bool


def ratio(
    everything: Numbers,
    before: Numbers,
    names: Sequence[Hashable],
    may: NDArray[np.bool_],
) -> Ratio | None:
    """Return the odds that further frames add; None: they cannot tell.

    Parameters
    ----------
    everything, before
        Numbers of all frames, and of those before the further ones.
    names
        Of each number: those of one name are as far from their closed-form errors.
    may
        Which numbers the effect may change.

    Every simulated recording is summed with weights of the others, as the recorded one is: what the
    weights owe to the noise of few simulations favours neither.
    """
    may = may & everything.known & before.known
    scales = _scales((everything, before), names, may)
    seen, one, other = _sums((everything, before), scales, may)
    laws = [scipy.stats.t(len(x) - 1, x.mean(), _wide(x)) for x in (one, other)]
    if not all(_wide(x) > 0 for x in (one, other)):
        return None

    def nats(x: Array) -> Array:
        return np.asarray(laws[0].logpdf(x) - laws[1].logpdf(x))

    value = float(nats(seen)[0])
    clear = float(seen[0]) > float(laws[1].isf(CHANCE))
    return Ratio(value, float(nats(one).std(ddof=1)), value > 0 and clear)


def _wide(sums: Array) -> float:
    """Return the standard deviation of a further sum about the mean of these."""
    return float(sums.std(ddof=1)) * float(np.sqrt(1 + 1 / len(sums)))


def _scales(parts: Sequence[Numbers], names: Sequence[Hashable], may: NDArray[np.bool_]) -> Array:
    """Return how far numbers scatter without the effect, in closed-form errors, name by name."""
    groups: dict[Hashable, list[int]] = {}
    for i in np.flatnonzero(may).tolist():
        groups.setdefault(names[i], []).append(i)
    scales = np.ones(may.size)
    for which in groups.values():
        own = [part.other[:, which].var(0, ddof=1) / part.errors[which] ** 2 for part in parts]
        square = (np.sum(own) + _PRIOR) / (np.size(own) + _PRIOR)
        scales[which] = max(float(np.sqrt(square)), _LEAST_SCALE)
    return scales


def _sums(
    parts: Sequence[Numbers], scales: Array, may: NDArray[np.bool_]
) -> tuple[Array, Array, Array]:
    """Return what is added: recorded (1,), and of recordings with and without the effect."""
    sds = [(part.errors * scales)[may] for part in parts]
    ones, others = [part.one[:, may] for part in parts], [part.other[:, may] for part in parts]
    count = len(ones[0])
    first, second = np.empty(count), np.empty(count)
    for i in range(count):
        rest = np.arange(count) != i
        added = _Added.of([x[rest] for x in ones], [x[rest] for x in others], sds)
        first[i], second[i] = added([x[i] for x in ones]), added([x[i] for x in others])
    recorded = [part.recorded[may] for part in parts]
    return np.array([_Added.of(ones, others, sds)(recorded)]), first, second


@dataclass(frozen=True)
class _Score:
    """Numbers beside their mean without an effect, each times its weight."""

    mean: Array
    sd: Array
    weights: Array

    @classmethod
    def of(cls, one: Array, other: Array, sd: Array) -> "_Score":
        """Return the score of the change from `other` to `one`.

        A change counts as far as the simulations agree on it.
        """
        difference = one - other
        change = difference.mean(0)
        noise = difference.var(0, ddof=1) / len(difference)
        kept = change**2 / np.maximum(change**2 + noise, np.finfo(float).tiny)
        return cls(other.mean(0), sd, change * kept / sd)

    def __call__(self, values: Array) -> Array:
        """Return the terms of the score, by number."""
        return np.asarray(self.weights * ((values - self.mean) / self.sd))


@dataclass(frozen=True)
class _Added:
    """What further frames add to the score of those before.

    `low` and `high` bound what one number can add. Bounds of the scores themselves would not do:
    of a number far off in the frames before, more would be let through in all frames, for there it
    is better known, and the difference would say so of frames that show nothing.
    """

    everything: _Score
    before: _Score
    low: Array
    high: Array

    @classmethod
    def of(cls, ones: Sequence[Array], others: Sequence[Array], sds: Sequence[Array]) -> "_Added":
        """Return it of simulations of all frames and of those before, in this order."""
        everything, before = (
            _Score.of(one, other, sd) for one, other, sd in zip(ones, others, sds, strict=True)
        )
        # Additions are independent of the score before, so that variances add: that of a score's
        # term is its weight squared.
        square = everything.weights**2 - before.weights**2
        one, other = (everything(of[0]) - before(of[1]) for of in (ones, others))
        sd = np.sqrt(np.maximum(square, 0.0))
        ends = [
            (own.mean(0) - _BEYOND * wide, own.mean(0) + _BEYOND * wide)
            for own, wide in ((other, sd), (one, np.maximum(sd, one.std(0, ddof=1))))
        ]
        low, high = np.minimum(ends[0][0], ends[1][0]), np.maximum(ends[0][1], ends[1][1])
        return cls(everything, before, low, high)

    def __call__(self, values: Sequence[Array]) -> float:
        """Return what is added by one recording's numbers, of all frames and of those before."""
        terms = self.everything(values[0]) - self.before(values[1])
        return float(np.clip(terms, self.low, self.high).sum())
