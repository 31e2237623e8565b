"""Codes that are wide or narrow in step with powers of two: bits of wrong weight.

What the bits of a converter do is the same in every exposure, channel and frame: their histograms,
folded by the last bits of the code, add. Noise that covers a period leaves each of its codes as
likely, whatever light the pixels saw: at w cycles a code exp(-2 pi^2 s^2 w^2) of the density of the
light is left. Where that is nothing, the transform of the folded histogram is counting noise.
"""

from collections.abc import Mapping
from math import log, pi

import numpy as np
import scipy.special
from numpy.typing import NDArray

from analysis.mismatch.bank.lines import any_of
from analysis.mismatch.bank.peaks import Peak
from analysis.mismatch.bank.scalars import UNKNOWN, Number, score_of_log
from dsis.measures import Channel
from dsis.measures.spikes import variance_of_quartiles

Array = NDArray[np.float64]
LABEL, DETAIL, KIND = "code_imbalance of powers of two", "powers of two", "codes"
_PERIOD = 64  # codes
_LEAK = 11.0  # minus the logarithm of the density that is left: of 1e6 samples, a tenth of chance
_LEAST = 1e4  # samples
_PILED = 5.0  # standard errors by which noise leans to lower codes, or has tails
_SAFE = 0.5  # of the variance of a core of unknown law


class CodePhases:
    """Transforms of histograms of all exposures and channels, folded by the last bits of the code.

    Attributes
    ----------
    transform
        At k / 64 cycles a code, k = 1 .. 32: complex.
    samples
        That it was summed over.
    """

    def __init__(self) -> None:
        self.transform = np.zeros(_PERIOD // 2, np.complex128)
        self.samples = np.zeros(_PERIOD // 2)

    def add(self, channels: Mapping[str, Channel]) -> None:
        """Take one exposure; not a channel whose codes are clipped, or coarse, or pile up.

        At a full well noise is narrower than it is elsewhere, and leans to lower codes. What noise
        with tails covers its core does, and hangs on the law of that: half of the core's variance
        is counted on.
        """
        cycles = np.arange(1, _PERIOD // 2 + 1) / _PERIOD
        for channel in channels.values():
            codes, variance = channel.codes, channel.estimates["pixel_variance"].value
            cut = channel.clipped_low + channel.clipped_high
            if codes is None or cut != 0 or codes.lattice is None or codes.lattice.step != 1:
                continue
            leaning, tailed = (channel.estimates[own].departure for own in ("skewness", "kurtosis"))
            if leaning < -_PILED:
                continue
            if tailed > _PILED:
                variance = _SAFE * min(variance, _core_dn2(codes.counts))
            covered = 2 * pi**2 * variance * cycles**2 >= _LEAK
            folded = np.bincount(
                (codes.lowest + np.arange(codes.counts.size)) % _PERIOD, codes.counts, _PERIOD
            )
            self.transform[covered] += np.fft.rfft(folded)[1:][covered]
            self.samples[covered] += codes.total

    def number(self) -> Number:
        """Return the normal score of the period whose codes differ most."""
        chances = [own[0] for own in self._periods()]
        return (score_of_log(any_of(min(chances), len(chances))), 1.0) if chances else UNKNOWN

    def peak(self) -> Peak | None:
        """Return one cycle in that period, and as its power the rms deviation of widths."""
        _, period, rms = min(self._periods(), default=(0.0, 0, 0.0))
        return Peak(1 / period, 0.0, rms) if period else None

    def _periods(self) -> list[tuple[float, int, float]]:
        """Return log chance, codes and rms deviation of widths of each period that noise covers."""
        found = []
        period = 2
        while period <= _PERIOD:
            which = np.arange(_PERIOD // period, _PERIOD // 2 + 1, _PERIOD // period) - 1
            samples = self.samples[which]
            if samples.min() >= _LEAST:
                each = np.abs(self.transform[which]) ** 2 / samples
                twice = np.where(which < _PERIOD // 2 - 1, 2.0, 1.0)  # but the last, which is real
                chance = _log_chance(float(twice @ each), float(twice.sum()))
                rms = max(float(twice @ ((each - 1) / samples)), 0.0) ** 0.5
                found.append((chance, period, rms))
            period *= 2
        return found


def _core_dn2(counts: NDArray[np.integer]) -> float:
    """Return the variance of a histogram's middle half, of successive codes, were it normal."""
    low, high = np.interp([0.25, 0.75], np.cumsum(counts) / counts.sum(), np.arange(counts.size))
    return float(variance_of_quartiles(float(low), float(high)))


def _log_chance(chi2: float, dof: float) -> float:
    """Return the logarithm of the probability that chi-squared is larger, however small that is."""
    chance = float(scipy.special.chdtrc(dof, chi2))
    if chance > 0:
        return log(chance)
    # The first term of the tail's asymptotic series (DLMF 8.11.2).
    half, shape = chi2 / 2, dof / 2
    return (shape - 1) * log(half) - half - float(scipy.special.gammaln(shape))
