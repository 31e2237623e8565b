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
    seen, one, other = (
        all_of_them - earlier
        for all_of_them, earlier in zip(
            _sums(everything, scales, may), _sums(before, scales, may), strict=True
        )
    )
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


def _sums(numbers: Numbers, scales: Array, may: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Return the weighted sums: recorded (1,), and of recordings with and without the effect."""
    sd = (numbers.errors * scales)[may]
    one, other = numbers.one[:, may], numbers.other[:, may]
    count = len(one)
    first, second = np.empty(count), np.empty(count)
    for i in range(count):
        rest = np.arange(count) != i
        of = _Score.of(one[rest], other[rest], sd)
        first[i], second[i] = of(one[i]), of(other[i])
    return np.array([_Score.of(one, other, sd)(numbers.recorded[may])]), first, second


@dataclass(frozen=True)
class _Score:
    """A sum of numbers beside their mean without an effect, over their standard deviation.

    `low` and `high` bound what one number can contribute; `weights` are changes by the effect.
    """

    mean: Array
    sd: Array
    low: Array
    high: Array
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
        means = other.mean(0), one.mean(0)
        wide = sd, np.maximum(sd, one.std(0, ddof=1))
        low = np.minimum(*(m - _BEYOND * s for m, s in zip(means, wide, strict=True)))
        high = np.maximum(*(m + _BEYOND * s for m, s in zip(means, wide, strict=True)))
        return cls(means[0], sd, low, high, change * kept / sd)

    def __call__(self, values: Array) -> float:
        """Return the score of one recording's numbers."""
        bounded = np.clip(values, self.low, self.high)
        return float(self.weights @ ((bounded - self.mean) / self.sd))
