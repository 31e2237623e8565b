"""How much likelier whole frames are by one cause of rows that are alike than by another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations
from math import log

import numpy as np
from scipy.special import logsumexp

from analysis.mismatch.model import apart
from analysis.mismatch.rowlaw import Cause, Fit, bands, beside, fitted, pink
from analysis.mismatch.rowpower import Powers, Size

_UNLIKE = 5.0  # standard deviations of the misfit: what is farther off, no cause here makes
_LENGTHS = 24  # of bands, in equal ratios
_SHORTEST, _LONGEST = 0.72, 1 / 4  # rows, and of the frame's
_BOTH = ("row_banding", "pink_noise")
BESIDE = frozenset({"row_noise", "black_level_drift", "flicker"})
"""What may move rows or frames besides."""


@dataclass(frozen=True)
class RowLaw:
    """What whole frames say of the causes that make rows alike.

    Attributes
    ----------
    size
        Of the frames.
    powers
        Of each exposure.
    """

    size: Size
    powers: Sequence[Powers]
    _found: dict[str, list[list["_Beside"]]] = field(default_factory=dict)

    def odds(self, kind: str, other: str, known: frozenset[str]) -> float | None:
        """Return by how much one cause is likelier than another, nats; None: nothing tells.

        Of what neither makes, no likelihood tells which of them is there.

        Parameters
        ----------
        kind, other
            `row_banding` and `pink_noise`.
        known
            Effects of `BESIDE` that are there.
        """
        if not self.powers:
            return None
        (one, off), (two, farther) = self._evidence(kind, known), self._evidence(other, known)
        return None if (off if one > two else farther) > _UNLIKE else one - two

    def beside_either(self, other: str, known: frozenset[str]) -> float:
        """Return by how much likelier it is that something is there besides than that it is not.

        Nats, whichever of both causes it is beside. `other` is one of `BESIDE`, and not `known`.
        """
        if not self.powers:
            return -np.inf

        def there(kinds: tuple[str, ...]) -> bool:
            return other in kinds

        def gone(kinds: tuple[str, ...]) -> bool:
            return other not in kinds

        found = [self._evidence(kind, known, own) for own in (gone, there) for kind in _BOTH]
        without, with_it = (logsumexp([one for one, _ in some]) for some in (found[:2], found[2:]))
        sure = max(found)[1] <= _UNLIKE and np.isfinite(with_it)
        return float(with_it - without) if sure else -np.inf

    def size_besides(self, other: str, known: frozenset[str]) -> float | None:
        """Return the standard deviation that something has besides, DN; None: it is not there.

        The mean over all laws of the bands or the noise that it may be beside, as likely as each
        is. `other` is one of `BESIDE` in DN.
        """
        sizes, weights = [], []
        for kind in _BOTH if self.powers else ():
            self._evidence(kind, known)
            for kinds, fit in (one for own in self._found[kind] for one in own if other in one[0]):
                sizes.append(float(fit.variances[1 + kinds.index(other)]) ** 0.5)
                of_law = fit.loglik - log(len(self._found[kind]))
                weights.append(of_law - self._cost(kinds, known))
        if not sizes:
            return None
        return float(np.exp(np.array(weights) - logsumexp(weights)) @ sizes)

    def _evidence(
        self,
        kind: str,
        known: frozenset[str],
        judged: Callable[[tuple[str, ...]], bool] = lambda _: True,
    ) -> tuple[float, float]:
        """Return the log-likelihood of a cause, and by how much powers are off it.

        Of bands the mean over all lengths, alike likely before, and the misfit of the best.

        Their variances cost both the same. What may be there besides, and is not known, costs half
        of the logarithm of how many numbers show it (Schwarz, 1978). `judged` are fits of what is
        there besides.
        """
        if kind not in self._found:
            beside_all = partial(_fitted, self.powers, self.size)
            self._found[kind] = apart(beside_all, self._causes(kind))
        some = [[one for one in own if judged(one[0])] for own in self._found[kind]]
        each = [self._best(own, known) for own in some]
        loglik = float(logsumexp([one for one, _ in each])) - log(len(each))
        return loglik, max(each)[1]

    def _causes(self, kind: str) -> list[Cause]:
        """Return a cause of each length it may have."""
        if kind == "pink_noise":
            return [pink(self.size)]
        lengths = np.geomspace(_SHORTEST, _LONGEST * self.size.rows, _LENGTHS)
        return [bands(self.size, float(length)) for length in lengths]

    def _best(self, fits: list["_Beside"], known: frozenset[str]) -> tuple[float, float]:
        each = [(fit.loglik - self._cost(kinds, known), fit.off) for kinds, fit in fits]
        return max(each, default=(-np.inf, np.inf))

    def _cost(self, kinds: tuple[str, ...], known: frozenset[str]) -> float:
        """Return what it costs that effects are there besides, nats."""
        frames = sum(own.frames for own in self.powers)
        numbers = dict.fromkeys(BESIDE, frames) | {"row_noise": frames * (self.size.rows - 1)}
        return sum(log(numbers[kind]) / 2 for kind in kinds if kind not in known)


_Beside = tuple[tuple[str, ...], Fit]
"""What else is there beside a cause, and the fit of all."""


def _fitted(powers: Sequence[Powers], size: Size, own: Cause) -> list[_Beside]:
    """Return the fits of a cause beside whatever else may be there."""
    causes, found = beside(size), []
    for count in range(len(causes) + 1):
        for kinds in combinations(causes, count):
            fit = fitted(powers, size, [own, *(causes[kind] for kind in kinds)])
            found += [] if fit is None else [(kinds, fit)]
    return found
