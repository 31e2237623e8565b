"""Dark currents that differ in all pixels: how far, by the likeliest law of a map that grows.

Pixels' dark currents are log-normal (Baer, Proc. SPIE 6068, 2006): d exp(s k - s^2 / 2), k standard
normal, of mean d. What frames show of them has normal noise besides. Of that sum there is no closed
form: it is a mixture of normal laws, one for each k of a fine grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, hypot, inf, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_AROUND = 15  # pixels: what is smooth is a glow, or light
_LINES = 4.0  # standard deviations of the variance of lines' means
_CLIPPED = 5.0  # robust standard deviations, beyond which a pixel is none of the many around
BIN = 0.05  # of noise, and beyond `_FAR` noises of a value's logarithm
_FAR = 10.0
_NODES, _END = 400, 6.0  # of the grid of k
_SIGMAS = np.geomspace(0.02, 3.0, 48)
_SPANS, _FINE = (1.12, 1.12, 1.02), 15  # of finer grids, and their points
_LEFT = 0.1  # of a mean, that others than hot pixels have
_FARTHEST = 0.5  # of a logarithm, to either side of the likeliest
_LEAST = 1e-300
_STRAY = np.array([0.0, 1e-4, 1e-3, 1e-2])  # shares of pixels of no such law
_HOT = np.concatenate([[0.0], np.geomspace(1e-4, 0.4, 12)])  # and of hot ones
_HOTTER = np.geomspace(1.0, 300.0, 11)  # their mean, in robust standard deviations of all
_WIDER = np.linspace(1.0, 1.1, 11)  # noise that is known to a tenth
_INTERVAL = 0.5  # of log-likelihood: a standard error


@dataclass(frozen=True)
class Spread:
    """How far dark currents differ.

    Attributes
    ----------
    log_sigma, error
        Standard deviation of their logarithm about a mean that hot pixels have a part in, and its
        standard error.
    gain
        Of log-likelihood beside equal dark currents, and noise up to a tenth larger, nats.
    """

    log_sigma: float
    error: float
    gain: float


def of_all(sigma: float, ratio: float) -> float:
    """Return the spread about another mean, of the same standard deviation.

    `ratio` is that of the mean whose spread `sigma` is to the other.
    """
    return sqrt(np.log1p(np.expm1(sigma**2) * ratio**2))


@dataclass(frozen=True)
class Binned:
    """Values of a map's pixels, in noises from their median, and how many there are of each."""

    values: Array
    counts: Array

    @classmethod
    def of(cls, values: Array, noise: float) -> "Binned":
        """Return pixels, those of much the same value as one."""
        unit = ((values - np.median(values)) / noise).ravel()
        size = np.maximum(np.abs(unit), _FAR)
        far = np.sign(unit) * _FAR * np.exp(np.round(np.log(size / _FAR) / BIN) * BIN)
        rounded = np.where(size > _FAR, far, np.round(unit / BIN) * BIN)
        own, counts = np.unique(rounded, return_counts=True)
        return cls(own, counts.astype(np.float64))


@dataclass(frozen=True)
class Body:
    """The law of most pixels: log-normal dark currents beside normal noise, all in noises.

    Attributes
    ----------
    mean
        Of the dark currents.
    log_sigma
        Of their logarithm; 0: all are the same.
    shot
        Share of the noise variance that is a mean dark current's shot noise: dark pixels have less.
    """

    mean: float = 0.0
    log_sigma: float = 0.0
    shot: float = 0.0

    def __bool__(self) -> bool:
        """Return whether dark currents differ."""
        return bool(self.mean > 0 and self.log_sigma > 0)

    def density(self, values: Array, width: float) -> Array:
        """Return the density at values from the median, where noise is so many times as wide."""
        centres, widths, weights = self._parts(width)
        unit = (values[:, np.newaxis] + self._middle(width) - centres) / widths
        return np.asarray((np.exp(-(unit**2) / 2) / (widths * sqrt(2 * pi))) @ weights)

    def _middle(self, width: float) -> float:
        centres, widths, weights = self._parts(width)
        if centres.size == 1:
            return 0.0
        ends = float((centres - 9 * widths).min()), float((centres + 9 * widths).max())
        return float(brentq(lambda x: ndtr((x - centres) / widths) @ weights - 0.5, *ends))

    def _parts(self, width: float) -> tuple[Array, Array, Array]:
        """Return centres, widths and weights of normal laws."""
        if not self:
            return np.zeros(1), np.full(1, width), np.ones(1)
        k = np.linspace(-_END, _END, _NODES)
        weights = np.exp(-(k**2) / 2)
        s = self.log_sigma
        own = self.mean * np.exp(s * k - s**2 / 2)
        noise = width * np.sqrt(1 + self.shot * (own / self.mean - 1))
        between = own * s * (k[1] - k[0])  # where they lie far apart, each stands for all between
        return own - self.mean, np.hypot(noise, between), weights / weights.sum()


@dataclass(frozen=True)
class _Pixels:
    """Pixels of a channel, beside what is alike for every body.

    Attributes
    ----------
    seen
        Values and counts.
    equal
        The law of equal dark currents.
    stray
        Density of what may lie anywhere: (value,).
    hot, means
        Densities of hot pixels, (mean, value), and their means in noises.
    """

    seen: Binned
    equal: Body
    stray: Array
    hot: Array
    means: Array

    @classmethod
    def of(cls, image: Array, noise: float, out: Mask, mean: float, shot: float) -> "_Pixels":
        """Return the pixels of a map, from what is smooth there."""
        rest, scatter = image, 0.0
        for axis in (1, 0):
            rest, more = _without_lines(rest, axis)
            scatter = hypot(scatter, more)
        most = _most(rest)
        smooth = uniform_filter(most, _AROUND, mode="reflect")
        # Of n pixels the mean has a share of 1 / n of each, and the noise of the others.
        count = _AROUND**2
        own = hypot(noise, scatter, float(most.std()) / sqrt(count - 1))
        rest = (rest - np.median(rest) - smooth)[~out] * count / (count - 1)
        seen = Binned.of(rest, own)
        size = np.abs(seen.values)
        # As often between 2 and 4 noises as between 20 and 40 (Jeffreys).
        stray = 1 / (2 * (1 + size) * log(2 + float(size.max())))
        means = _HOTTER * max(_robust(rest - np.median(rest)) / own, 1.0)
        hot = np.stack([np.exp(exponential(seen.values, 1 / one)) for one in means])
        return cls(seen, Body(mean / own, 0.0, shot * (noise / own) ** 2), stray, hot, means)

    def of_mean(self, mean: float) -> "_Pixels":
        """Return the pixels where those that are not hot have another mean, in noises."""
        return replace(self, equal=replace(self.equal, mean=mean))

    def without(self, fit: "_Fit") -> "_Pixels":
        """Return the pixels where those that are not hot lack what hot ones have of the mean."""
        rest = self.equal.mean - fit.share * float(self.means[fit.which])
        return self.of_mean(max(rest, _LEFT * self.equal.mean))


def _most(image: Array) -> Array:
    """Return a map about its median, what is far out drawn in."""
    centred = image - np.median(image)
    limit = _CLIPPED * _robust(centred)
    return np.asarray(np.clip(centred, -limit, limit))


def _without_lines(image: Array, axis: int) -> tuple[Array, float]:
    """Return a map without what lines along an axis share, and the noise that comes by that.

    Only where their means scatter by more than their pixels make them.
    """
    most = _most(image)
    means, length = most.mean(axis, keepdims=True), image.shape[axis]
    scatter = float(most.std()) / sqrt(length)
    if length < 2 or float(means.var()) <= scatter**2 * (1 + _LINES * sqrt(2 / means.size)):
        return image, 0.0
    return (image - means) * length / (length - 1), float(most.std()) / sqrt(length - 1)


def exponential(values: Array, rate: Array | float) -> Array:
    """Return the log-density of exponential variates of a rate beside normal noise of 1.

    Exponentially modified Gaussian (Grushka, Analytical Chemistry 44, 1972).
    """
    return np.asarray(np.log(rate) + rate**2 / 2 - rate * values + log_ndtr(values - rate))


def _robust(values: Array) -> float:
    return 1.4826 * float(np.median(np.abs(values)))


def current_spread(
    maps: Sequence[tuple[Array, float, Mask]],
    mean: float,
    mean_error: float = 0.0,
    shot: float = 0.0,
) -> Spread | None:
    """Return how far dark currents differ between pixels; None: nothing is known of them.

    Pixels that are none of the law are hot, or jump and may lie anywhere: some shares of all.

    Parameters
    ----------
    maps
        Of each channel a map (row, column) that grows with exposure time, its noise, and which
        pixels are left out.
    mean, mean_error
        Dark current and its standard error, in the maps' unit.
    shot
        Share of the maps' noise variance that is its shot noise.
    """
    some = [own for own in maps if own[1] > 0 and not own[2].all()]
    if not some or mean <= 0:
        return None
    pixels = [_Pixels.of(*own, mean, shot) for own in some]
    equal = max(_loglik(pixels, 0.0, wider).nats for wider in _WIDER)
    fits = [_with_hot(pixels, shares) for shares in (_HOT[:1], _HOT)]
    best, law = max(fits, key=lambda fit: fit[0].nats)
    if best.nats <= equal:
        return None
    # These pixels' own mean is another than that of all sensors; of hot ones there are few.
    count = sum(float(own.seen.counts.sum()) for own in pixels)
    left = float(np.mean([a.equal.mean / b.equal.mean for a, b in zip(law, pixels, strict=True)]))
    hot = (1 - left) / left / sqrt(max(best.share * count / 2, 1.0))
    own = sqrt(np.expm1(best.sigma**2) / count)
    away = 1 + float(np.linalg.norm([mean_error / mean, hot, own]))
    brighter = [own.of_mean(own.equal.mean * away) for own in law]
    moved = _likeliest(brighter, best.sigma * np.geomspace(1 / away, away, _FINE)).sigma
    error = float(np.hypot(_error(law, best.sigma), moved - best.sigma))
    return Spread(of_all(best.sigma, left), error, best.nats - equal)


@dataclass(frozen=True)
class _Fit:
    """A law's log-likelihood, the share of hot pixels, and which of their means is likeliest."""

    sigma: float
    nats: float
    share: float
    which: int


def _with_hot(pixels: Sequence[_Pixels], hot: Array) -> tuple[_Fit, Sequence[_Pixels]]:
    """Return the likeliest law beside such shares of hot pixels, and the others of its mean."""
    best, law = _likeliest(pixels, _SIGMAS, hot), pixels
    for span in _SPANS:  # what hot ones have of the mean, the others have not
        law = [own.without(best) for own in pixels]
        best = _likeliest(law, best.sigma * np.geomspace(1 / span, span, _FINE), hot)
    return best, law


def _likeliest(pixels: Sequence[_Pixels], sigmas: Array, hot: Array = _HOT) -> _Fit:
    fits = (_loglik(pixels, sigma, shares=hot) for sigma in sigmas.tolist())
    return max(fits, key=lambda fit: fit.nats)


def _error(pixels: Sequence[_Pixels], sigma: float) -> float:
    """Return the standard error, by the curvature of the log-likelihood; infinite where flat."""
    step, relative = 0.02, inf
    for _ in range(20):  # until half a nat is lost or so
        here, below, above = (_loglik(pixels, sigma * exp(x)).nats for x in (0.0, -step, step))
        bent = (2 * here - below - above) / step**2
        relative = sqrt(2 * _INTERVAL / bent) if bent > 0 else inf
        if 0.5 * step < relative < 2 * step or (relative > step >= _FARTHEST):
            break
        step = min(max(relative, step / 8), step * 8, _FARTHEST)
    return sigma * relative


def _loglik(
    pixels: Sequence[_Pixels], sigma: float, width: float = 1.0, shares: Array = _HOT
) -> _Fit:
    """Return how likely a law is, with the likeliest shares of pixels that are none of it."""
    total = np.zeros((_STRAY.size, _HOTTER.size, shares.size))
    for own in pixels:
        body = replace(own.equal, log_sigma=sigma).density(own.seen.values, width)
        for i, stray in enumerate(_STRAY):
            most = (1 - stray) * np.maximum(body, _LEAST) + stray * own.stray
            for j, hot in enumerate(own.hot):
                beside = np.log(most + shares[:, np.newaxis] * (hot - most))
                total[i, j] += beside @ own.seen.counts
    _, which, share = np.unravel_index(int(total.argmax()), total.shape)
    return _Fit(sigma, float(total.max()), float(shares[share]), int(which))
