"""Which codes occur, and whether the density of codes is as smooth as noise makes it.

Pixel noise of standard deviation s convolves the density of codes with a Gaussian: at w cycles per
code exp(-2 pi^2 s^2 w^2) of it is left. What the histogram's spectrum holds where that is nothing,
above counting noise, is unequal code widths, whatever light, pattern or drift the pixels saw.
"""

from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.special
from numpy.typing import NDArray

from dsis.measures.estimate import Estimate, estimate, unknown

LOWEST_CODE, CODES = -(2**16), 2**18  # the first code counted, and how many
LEAST_SIGMA_STEPS = 2.0  # below, noise does not smooth the density: no code width can be told
_LEAK = 1e-7  # of the smooth density's power is let into the band


@dataclass(frozen=True)
class Codes:
    """Histogram of whole codes of one channel.

    Attributes
    ----------
    lowest
        Code of the first count, DN.
    counts
        Pixels and frames with each code: int64.
    """

    lowest: int
    counts: NDArray[np.int64]

    @classmethod
    def of(cls, lowest: int, counts: NDArray[np.int64]) -> "Codes":
        """Return the histogram without the empty ends."""
        used = np.flatnonzero(counts)
        return cls(lowest + int(used[0]), counts[used[0] : used[-1] + 1].copy())

    def share_at_most(self, code: float) -> float:
        """Return the share of samples at or below a code."""
        return float(self.counts[: max(int(code) - self.lowest + 1, 0)].sum() / self.counts.sum())

    def share_at_least(self, code: float) -> float:
        """Return the share of samples at or above a code."""
        return float(self.counts[max(int(code) - self.lowest, 0) :].sum() / self.counts.sum())

    def spacing(self) -> Estimate:
        """Return the greatest common step of the codes that occur, DN.

        Exact; its error is the chance that all codes seen lie on twice the true step. The ends may
        be clipped off the lattice and are left out where something lies between them.
        """
        used = np.flatnonzero(self.counts)
        if self._clipped():
            used = used[1:-1]
        if used.size < 2:
            return unknown(1.0)
        step = int(np.gcd.reduce(np.diff(used)))
        chance = (step * 2.0 ** (-min(used.size, 80) / 2)) ** 2
        return estimate(step, chance, 1.0, chance)

    def imbalance(self, variance_dn2: float) -> Estimate:
        """Return the rms relative deviation of code widths, sign of its square kept.

        Unknown where the pixel noise `variance_dn2` is below 2 steps, or codes are clipped.

        Notes
        -----
        With D(w) the transform of counts h, mean |D|^2 over the band = sum h + rms^2 sum h^2.
        """
        step = self.spacing().value
        sigma = np.sqrt(variance_dn2) / step
        if not sigma >= LEAST_SIGMA_STEPS or self._clipped():
            return unknown(0.0)
        counts = self.counts[:: int(step)].astype(np.float64)
        size = scipy.fft.next_fast_len(2 * counts.size, real=True)
        frequency = np.arange(size // 2 + 1) / size
        edge = np.sqrt(-np.log(_LEAK) / (4 * np.pi**2)) / sigma
        weight = np.where(frequency >= edge, 2.0, 0.0)
        if size % 2 == 0:
            weight[-1] = 1.0
        power = np.abs(scipy.fft.rfft(counts, size)) ** 2
        total, squares = counts.sum(), float((counts**2).sum() - counts.sum())
        excess = float((weight * power).sum() / weight.sum() - total) / squares
        band = scipy.fft.irfft(np.where(frequency >= edge, 1.0, 0.0), size)
        window = (band / band[0]) ** 2
        null = _quadratic(counts, window) / squares**2
        error = _quadratic(counts + max(excess, 0.0) * counts**2, window) / squares**2
        mean, variance = _signed_root(2 * (total / squares) ** 2 / null)
        # Far above the noise the root's error is that of its square over 2 rms.
        clear = max(excess - 2 * error**0.5, 0.0)
        return estimate(
            float(np.sign(excess) * np.sqrt(np.abs(excess))),
            error / (4 * clear + error**0.5 / variance),
            mean * null**0.25,
            variance * null**0.5,
        )

    def _clipped(self) -> bool:
        """Whether the ends hold more than the tail of a smooth density would."""
        few = 5 + 0.1 * np.sqrt(self.counts.sum())
        return bool(max(self.counts[0], self.counts[-1]) > few)


def _quadratic(variances: NDArray[np.float64], window: NDArray[np.float64]) -> float:
    """Return 2 sum window(j - k) v_j v_k: the variance of a sum over pairs of codes."""
    size = window.size
    power = np.abs(scipy.fft.rfft(variances, size)) ** 2
    return 2 * float((window * scipy.fft.irfft(power, size)).sum())


def _signed_root(dof: float) -> tuple[float, float]:
    """Return mean and variance of sign(z) sqrt|z|, z a standardised chi-squared variate."""
    share = (np.arange(250) + 0.5) / 250
    z = (scipy.special.gammaincinv(dof / 2, share) * 2 / dof - 1) * np.sqrt(dof / 2)
    root = np.sign(z) * np.sqrt(np.abs(z))
    return float(root.mean()), float(root.var())
