"""Which codes occur, and whether the density of codes is as smooth as noise makes it.

Pixel noise of standard deviation s convolves the density of codes with a Gaussian: at w cycles per
code exp(-2 pi^2 s^2 w^2) of it is left. What the histogram's spectrum holds where that is nothing,
above counting noise, is unequal code widths, whatever light, pattern or drift the pixels saw.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from math import nan

import numpy as np
import scipy.fft
import scipy.special
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from dsis.kept import Kept
from dsis.measures.estimate import Estimate, estimate, unknown
from dsis.measures.histogram import Histogram, histogram, limits, piled_up, squared
from dsis.measures.kernels import count_codes
from dsis.measures.spikes import variance_of_quartiles, without_spikes

LOWEST_CODE, CODES = -(2**16), 2**18  # the first code counted, and how many
LEAST_SIGMA_STEPS = 2.0  # below, noise does not smooth the density: no code width can be told
_LEAST_CODES = 4  # whose common step is larger by chance once in 8 times, much larger hardly ever
_LEAK = 1e-7  # of the smooth density's power is let into the band
_BANDS = Kept(32 << 20)  # bytes, of bands: 500 of transforms of a bright exposure of 12 bits
_CLOSER = 1.01  # of degrees of freedom whose law is known
_RATIO = 1.03  # of the sizes of bands, and of where they begin
_LEAST_DOF, _NODES = 4.0, 20
_MIDDLE = (0.05, 0.95)  # of the samples: there no density is less than a tenth of its mean
_EXPECTED = 300.0  # samples a code there on average: at a tenth of it none is missed by chance
_INNER = (0.25, 0.75)  # of the samples: there no density is less than two thirds of its mean
_EXPECTED_INNER = 45.0  # samples a code there on average
_AROUND, _NEVER_MISSED = 65, 12.0  # codes; samples a code of which none is missed by chance
_FEW = 20.0  # samples a code there: of fewer many are missed by chance


@dataclass(frozen=True)
class Lattice:
    """Codes from one to the next of which there are whole steps.

    Attributes
    ----------
    code
        One of them, DN.
    step
        The greatest that all their differences are multiples of, DN, at least 1; 0: one code only.
    """

    code: int
    step: int

    def joined(self, other: "Lattice") -> "Lattice":
        """Return that of the codes of both."""
        return Lattice(self.code, math.gcd(self.step, other.step, self.code - other.code))

    def phase(self, step: int) -> int:
        """Return what codes leave when divided by a step that their own is a multiple of, DN."""
        return self.code % step


@dataclass(frozen=True)
class Middle:
    """Codes in the middle of a histogram, and which of them never occur.

    Attributes
    ----------
    first, last
        Codes at 5 and 95 % of the samples, DN; of fewer samples a code at 25 and 75 %.
    step
        Between codes that a converter gives, DN.
    absent
        Codes between that never occur, though each would many times were all equally wide, DN:
        int64, ascending.
    """

    first: int
    last: int
    step: int
    absent: NDArray[np.int64]

    @property
    def codes(self) -> int:
        """How many there are, absent or not."""
        return (self.last - self.first) // self.step + 1


def _left_out(counts: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return which codes of a histogram never occur where those around have many samples.

    Between two levels that lie far apart, as halves of a sensor may have, codes are missed by
    chance.
    """
    around = uniform_filter1d(counts.astype(np.float64), _AROUND, mode="nearest")
    return np.flatnonzero((counts == 0) & (around >= _NEVER_MISSED))


class CodeCounts:
    """Counts of whole codes by phase, held for the range of codes that was seen.

    Attributes
    ----------
    whole
        Whether all frames held whole codes within the range that is counted.
    lowest
        Code of the first count, DN.
    counts
        (row parity, column parity, code - lowest): int64.
    """

    def __init__(self) -> None:
        self.whole = True
        self.lowest = 0
        self.counts = np.zeros((2, 2, 0), np.int64)

    def add(self, frame: NDArray[np.float32], *, whole: bool, low: int, high: int) -> None:
        """Count the codes of a frame: whether they are whole, the lowest and the highest."""
        self.add_all(frame[np.newaxis], whole=whole, low=low, high=high)

    def add_all(self, frames: NDArray[np.float32], *, whole: bool, low: int, high: int) -> None:
        """Count the codes of frames (frame, row, column) that are whole, or not, in all of them."""
        self.whole = self.whole and whole and low >= LOWEST_CODE and high < LOWEST_CODE + CODES
        if self.whole:
            self._make_room(low, high)
            count_codes(frames, self.counts, self.lowest)

    def of(self, phases: tuple[tuple[int, int], ...]) -> "Codes | None":
        """Return the histogram of some phases; None where frames held other values."""
        if not self.whole:
            return None
        own = [self.counts[phase] for phase in phases]
        return Codes.of(self.lowest, np.sum(own, axis=0) if len(own) > 1 else own[0])

    def _make_room(self, low: int, high: int) -> None:
        size = self.counts.shape[2]
        if size and low >= self.lowest and high < self.lowest + size:
            return
        margin = high - low + 64
        first, last = low - margin, high + margin
        if size:
            first, last = min(first, self.lowest), max(last, self.lowest + size - 1)
        wider = np.zeros((2, 2, last - first + 1), np.int64)
        start = self.lowest - first if size else 0
        wider[:, :, start : start + size] = self.counts
        self.lowest, self.counts = first, wider


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
        first, last = limits(counts)
        return cls(lowest + first, counts[first : last + 1].copy())

    @property
    def total(self) -> int:
        """Samples."""
        return self._shown.total

    def share_at_most(self, code: float) -> float:
        """Return the share of samples at or below a code."""
        places = int(code) - self.lowest + 1
        return float(self.counts[:places].sum() / self.total) if places > 0 else 0.0

    def share_at_least(self, code: float) -> float:
        """Return the share of samples at or above a code."""
        place = max(int(code) - self.lowest, 0)
        return float(self.counts[place:].sum() / self.total) if place < self.counts.size else 0.0

    def ends(self, lowest: float, highest: float) -> tuple[float, float]:
        """Return the first and the last code that a converter of these ends can give, DN.

        Those of its steps, which need not reach either end; of few codes steps are not known. Where
        samples are piled up at the lowest code that occurs they were cut off there.
        """
        own = self.lattice
        if piled_up(self.counts):
            lowest = max(lowest, self.lowest)
        if own is None or own.step <= 1 or self._shown.used < _LEAST_CODES:
            return lowest, highest
        first = lowest + (own.code - lowest) % own.step
        return first, highest - (highest - own.code) % own.step

    def spacing(self) -> Estimate:
        """Return the greatest common step of the codes that occur, DN.

        Exact; its error is the chance that all codes seen lie on twice the true step. The ends may
        be clipped off the lattice and are left out where something lies between them. Unknown where
        no two codes of several samples lie one step apart: few spikes, beside one code that all
        others have, lie on a coarser lattice by chance.
        """
        used, step = self._shown.used, self._shown.step
        if used < 2:
            return unknown(1.0)
        seen = self.counts[self._shown.first :: step] > 1
        if step > 1 and not (seen[1:] & seen[:-1]).any():
            return unknown(1.0)
        chance = (step * 2.0 ** (-min(used, 80) / 2)) ** 2
        return estimate(step, chance, 1.0, chance)

    @cached_property
    def lattice(self) -> Lattice | None:
        """Where the codes lie that `spacing` looks at; None: there is none."""
        shown = self._shown
        return Lattice(self.lowest + shown.first, shown.step) if shown.used else None

    @property
    def middle(self) -> Middle | None:
        """The middle of the histogram; None: its codes have too few samples to tell absent ones."""
        if self.lattice is None or self.lattice.step < 1:
            return None
        step = self.lattice.step
        skipped = (self.lattice.code - self.lowest) % step
        counts, start = self.counts[skipped::step], self.lowest + skipped
        below = np.cumsum(counts)
        for ends, expected in ((_MIDDLE, _EXPECTED), (_INNER, _EXPECTED_INNER)):
            first, last = np.searchsorted(below, np.array(ends) * below[-1])
            inside = counts[first : last + 1]
            if inside.size >= _LEAST_CODES and inside.mean() >= expected:
                absent = start + step * (first + _left_out(inside))
                return Middle(int(start + step * first), int(start + step * last), step, absent)
        return None

    @property
    def gap(self) -> float:
        """How far apart codes lie in the middle, DN, mean over samples; nan: it cannot be told.

        Each sample has half the distance between the codes on both sides of its own. So it is the
        step of a converter whose steps are alike, and what most samples are rounded to where they
        are not. Of few samples a code codes are missed by chance: nothing is told.
        """
        used = np.flatnonzero(self.counts)
        if used.size < 2:
            return nan
        first, last = np.searchsorted(np.cumsum(self.counts) / self.total, _MIDDLE)
        step = max(self.lattice.step if self.lattice else 1, 1)
        if self.total * step < _FEW * (last - first + 1):
            return nan
        apart = np.diff(used).astype(np.float64)
        around = (np.append(apart, apart[-1]) + np.insert(apart, 0, apart[0])) / 2
        inside = (used >= first) & (used <= last)  # what lies far out is around few samples
        counts = self.counts[used[inside]]
        return float(around[inside] @ counts / counts.sum())

    def imbalance(self, variance_dn2: float) -> Estimate:
        """Return the rms relative deviation of code widths, sign of its square kept.

        Unknown where the pixel noise `variance_dn2` is below 2 steps, or codes are clipped. Where a
        few spikes make most of that variance, the middle of the histogram says how wide noise is.

        Notes
        -----
        With D(w) the transform of counts h, mean |D|^2 over the band = sum h + rms^2 sum h^2. The
        band begins up to 3 %, or a bin, above the frequency from which noise leaves nothing: so few
        bands serve many histograms, and none of them lets in more of the smooth density.
        """
        shown = self._shown
        middle_dn2 = variance_of_quartiles(shown.low, shown.high)
        variance_dn2 = without_spikes(variance_dn2, middle_dn2)
        if shown.clipped or shown.used < 2 or not variance_dn2 >= 0:
            return unknown(0.0)
        sigma = variance_dn2**0.5 / shown.step
        if sigma < LEAST_SIGMA_STEPS:
            return unknown(0.0)
        counts = self.counts[:: shown.step].astype(np.float64)
        size, mean_of, pairs_of = _band_of(counts.size, sigma)
        power = _power(counts, size)
        total, squares = shown.total, shown.squares - shown.total
        excess = (float(mean_of.dot(power)) - total) / squares
        null = error = float(pairs_of.dot(power)) / squares**2
        if excess > 0:
            raised = _power(counts + excess * counts**2, size)
            error = float(pairs_of.dot(raised)) / squares**2
        mean, variance = _signed_root(2 * (total / squares) ** 2 / null)
        # Far above the noise the root's error is that of its square over 2 rms.
        clear = max(excess - 2 * error**0.5, 0.0)
        return estimate(
            math.copysign(abs(excess) ** 0.5, excess),
            error / (4 * clear + error**0.5 / variance),
            mean * null**0.25,
            variance * null**0.5,
        )

    @cached_property
    def _shown(self) -> Histogram:
        return histogram(self.counts)


def _band_of(codes: int, sigma: float) -> tuple[int, NDArray[np.float64], NDArray[np.float64]]:
    """Return size and weights of a band for so many codes and noise of `sigma` steps.

    The size of the transform; `_band`. Size and first bin are rounded up: see `Codes.imbalance`.
    """
    size = _size_of(codes)
    edge = (-math.log(_LEAK) / (4 * math.pi**2)) ** 0.5 / sigma
    first = _coarse(edge * size)
    mean, pairs = _BANDS.of((size, first), partial(_band, size, first))
    return size, mean, pairs


@lru_cache(maxsize=4096)
def _size_of(codes: int) -> int:
    """Return the size of a transform that holds so many codes, and as many zeros."""
    return int(scipy.fft.next_fast_len(_coarse(2 * codes), real=True))


def _coarse(number: float) -> int:
    """Return the next of few whole numbers, each of the larger ones 3 % above the last."""
    return math.ceil(_RATIO ** math.ceil(math.log(number) / math.log(_RATIO)))


def _band(size: int, first: int) -> NDArray[np.float64]:
    """Return the band from bin `first` on, as weights on bins: (2, half spectrum).

    The first give the mean over the band. The others give 2 sum window(j - k) v_j v_k, the variance
    of a sum over pairs of codes: v the counts' variances, window the band's transform squared, 1 at
    0.
    """
    bins = np.arange(size // 2 + 1)
    halves = np.full(bins.size, 2.0)
    halves[0] = 1.0
    if size % 2 == 0:
        halves[-1] = 1.0
    mean = np.where(bins >= first, halves, 0.0)
    window = scipy.fft.irfft((bins >= first).astype(np.float64), size)
    transform = scipy.fft.rfft((window / window[0]) ** 2).real
    return np.stack([mean / mean.sum(), 2 * halves * transform / size])


def _power(counts: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Return the power of counts in each bin of a half spectrum."""
    return squared(np.fft.rfft(counts, size))  # scipy takes longer to begin


def _signed_root(dof: float) -> tuple[float, float]:
    """Return mean and variance of sign(z) sqrt|z|, z a standardised chi-squared variate.

    To 1 in 1000: of the nearest of few degrees of freedom.
    """
    return _root_of(round(math.log(dof) / math.log(_CLOSER)))


@lru_cache(maxsize=2048)
def _root_of(power: int) -> tuple[float, float]:
    dof = _CLOSER**power
    z = _quantiles(dof) if dof < _LEAST_DOF else _quantiles_between(dof)
    root = np.copysign(np.sqrt(np.abs(z)), z)
    mean = float(root.mean())
    return mean, float(root @ root) / root.size - mean**2


def _quantiles(dof: float) -> NDArray[np.float64]:
    """Return 250 quantiles of a standardised chi-squared variate."""
    share = (np.arange(250) + 0.5) / 250
    ratio = np.asarray(scipy.special.gammaincinv(dof / 2, share), np.float64) * 2 / dof
    return (ratio - 1) * math.sqrt(dof / 2)


def _quantiles_between(dof: float) -> NDArray[np.float64]:
    """Return the quantiles interpolated in 1 / sqrt(dof), where they are smooth: to 1e-12."""
    nodes, signs, table = _chebyshev()
    distance = 2 * (_LEAST_DOF / dof) ** 0.5 - 1 - nodes
    if not distance.all():
        return _quantiles(dof)  # at a node
    weights = signs / distance
    quantiles: NDArray[np.float64] = weights @ table / weights.sum()
    return quantiles


@lru_cache(maxsize=1)
def _chebyshev() -> tuple[NDArray[np.float64], ...]:
    """Return nodes, barycentric signs and quantiles (node, quantile)."""
    angle = math.pi * (np.arange(_NODES) + 0.5) / _NODES
    nodes, signs = np.cos(angle), np.sin(angle)
    signs[1::2] *= -1
    table = np.stack([_quantiles(4 * _LEAST_DOF / (node + 1) ** 2) for node in nodes.tolist()])
    return nodes, signs, table
