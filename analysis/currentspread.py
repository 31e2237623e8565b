"""How far dark currents differ from pixel to pixel, by the likeliest law of a map that grows.

See `currentlaw` for the law. Beside it few pixels are hot, and have a part of the mean of all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from hashlib import blake2b
from math import exp, hypot, inf, log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.stats import median_abs_deviation

from analysis.currentlaw import BIN, FAR, Binned, Body, exponential, of_all

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
CLEAR_GAIN = 4.5  # of log-likelihood: three standard errors
_AROUND = 15  # pixels: what is smooth is a glow, or light
_LINES = 4.0  # standard deviations of the variance of means of lines, and around pixels
_CLIPPED = 5.0  # robust standard deviations, beyond which a pixel is none of the many around
_SIGMAS = np.geomspace(0.03, 3.0, 16)
_LEFT = np.array([0.95, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])  # of the mean, beside hot ones
_TOLD = 3.0  # of log-likelihood: odds of 20
_ALMOST = 0.999
_CHANCES = (-2.0, -1.0, 0.0, 1.0, 2.0)  # standard deviations of a mean
_SPANS, _FINE = ((1.36, 0.1), (1.12, 0.03), (1.04, 0.01)), 7  # of finer grids, and their points
_STRAY = np.array([0.0, 1e-4, 1e-3, 1e-2])  # shares of pixels of no such law
_HOT = np.geomspace(1e-4, 0.1, 13)  # and of hot ones: they are few
_MANY, _NUMBERS = 20.0, 5  # pixels of a bin by which a law is judged; numbers of the law
_PARTS = (np.arange(5) + 0.5) / 5  # of a bin, where a law is asked
_FARTHEST = 0.5  # of a logarithm, to either side of the likeliest
_LEAST = 1e-300
_WIDER = np.linspace(1.0, 1.1, 6)  # noise that is known to a tenth
_AWAY = 10.0  # times the mean: if it may be farther off, nothing is known
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
    left
        Share of the mean that is not of hot pixels.
    """

    log_sigma: float
    error: float
    gain: float
    left: float = 1.0


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
    bright
        What hot ones have of the mean of all, in noises.
    """

    seen: Binned
    equal: Body
    stray: Array
    bright: float = 0.0

    @classmethod
    def of(cls, image: Array, noise: float, out: Mask, mean: float, shot: float) -> "_Pixels":
        """Return the pixels of a map, from what is smooth there."""
        rest, scatter = image, 0.0
        for axis in (1, 0):
            rest, more = _without_lines(rest, axis)
            scatter = hypot(scatter, more)
        rest, more = _without_smooth(rest)
        own = hypot(noise, scatter, more)
        seen = Binned.of((rest - np.median(rest))[~out], own)
        stray = _stray(seen.values, float(np.abs(seen.values).max()))
        # Codes may hide noise: what is left of it has no more than all from dark current.
        share = min(shot * (noise / own) ** 2, 1.0)
        return cls(seen, Body(mean / own, 0.0, share), stray)

    def of_mean(self, mean: float) -> "_Pixels":
        """Return the pixels where those that are not hot have another mean, in noises."""
        shot = min(self.equal.shot * mean / self.equal.mean, 1.0)
        return replace(self, equal=replace(self.equal, mean=mean, shot=shot))

    def beside_hot(self, left: float) -> "_Pixels":
        """Return the pixels where those that are not hot have a share of the mean of all."""
        return replace(self.of_mean(self.equal.mean * left), bright=self.equal.mean * (1 - left))

    def sharing(self, fit: "_Fit") -> "_Pixels":
        """Return the pixels with the mean that a fit leaves those that are not hot."""
        if fit.share:
            return self.beside_hot(fit.left)
        return self.of_mean(self.equal.mean * fit.left)

    def mixed(self, values: Array, fit: "_Fit") -> Array:
        """Return the density of all pixels at values: of a fit, stray and hot ones among them."""
        body = replace(self.equal, log_sigma=fit.sigma).density(values, 1.0)
        stray = _stray(values, float(np.abs(self.seen.values).max()))
        share = float(_STRAY[fit.stray])
        most = (1 - share) * body + share * stray
        if not fit.share:
            return np.asarray(most)
        return np.asarray(most + fit.share * (self.hot(values, fit.share) - most))

    @cached_property
    def all_hot(self) -> list[Array]:
        """The density of hot pixels at the values seen, for each share of them there may be."""
        if self.bright <= 0:
            return [np.zeros(0)]
        return [self.hot(self.seen.values, share) for share in _HOT.tolist()]

    def hot(self, values: Array, share: float) -> Array:
        """Return the density of hot pixels, a share of all: exponential ones of what is left."""
        return np.exp(exponential(values, share / self.bright))


def _stray(values: Array, farthest: float) -> Array:
    """Return the density of what lies anywhere up to a farthest value.

    As often between 2 and 4 noises as between 20 and 40 (Jeffreys).
    """
    return np.asarray(1 / (2 * (1 + np.abs(values)) * log(2 + farthest)))


def _most(image: Array) -> Array:
    """Return a map about its median, what is far out drawn in."""
    centred = image - np.median(image)
    limit = _CLIPPED * float(median_abs_deviation(centred, axis=None, scale="normal"))
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


def _without_smooth(image: Array) -> tuple[Array, float]:
    """Return a map without what is smooth in it, and the noise that comes by that.

    Only where means around pixels scatter by more than the pixels make them. Of n pixels the mean
    has a share of 1 / n of each, and the noise of the others.
    """
    most, count = _most(image), _AROUND**2
    smooth = uniform_filter(most, _AROUND, mode="reflect")
    scatter = float(most.std()) / sqrt(count)
    if float(smooth.var()) <= scatter**2 * (1 + _LINES * sqrt(2 * count / image.size)):
        return image, 0.0
    return (image - smooth) * count / (count - 1), float(most.std()) / sqrt(count - 1)


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
    digest = blake2b(digest_size=16)
    for image, noise, out in some:
        digest.update(image.tobytes() + np.float64(noise).tobytes() + out.tobytes())
    shot = round(shot, 2)  # no better known
    return _measured(_Asked((digest.digest(), mean, mean_error, shot), tuple(some)))


@dataclass(frozen=True)
class _Asked:
    """What is asked, once for the same maps and numbers: it takes a second."""

    numbers: tuple[bytes, float, float, float]
    maps: tuple[tuple[Array, float, Mask], ...] = field(compare=False)


@lru_cache(maxsize=16)
def _measured(asked: _Asked) -> Spread | None:
    _, mean, mean_error, shot = asked.numbers
    pixels = [_Pixels.of(*own, mean, shot) for own in asked.maps]
    known = mean_error / mean
    alone = _likeliest(pixels, known, _SIGMAS)
    if alone.nats <= _equal(pixels, np.ones(1)):
        return None
    best = max((alone, _beside_hot(pixels, _SIGMAS, _LEFT)), key=lambda fit: fit.nats)
    for span, apart in _SPANS:
        sigmas = best.sigma * np.geomspace(1 / span, span, _FINE)
        lefts = np.minimum(best.left * np.linspace(1 - apart, 1 + apart, _FINE), _ALMOST)
        fits = _likeliest(pixels, known, sigmas), _beside_hot(pixels, sigmas, np.unique(lefts))
        best = max((best, *fits), key=lambda fit: fit.nats)
    if best.nats <= (equal := _equal(pixels, np.append(1.0, _LEFT))):
        return None
    law = [own.sharing(best) for own in pixels]
    hot = (1 - best.left) / best.left / sqrt(best.share * _count(pixels) / 2) if best.share else 0.0
    away = 1 + hypot(known, hot, _own(pixels, best.sigma))
    away = min(away, _AWAY)
    sigmas = best.sigma * np.geomspace(1 / away, away, 2 * _FINE + 1)
    sigmas = np.minimum(sigmas, max(_SIGMAS[-1], best.sigma))
    brighter = [own.of_mean(own.equal.mean * away) for own in law]
    moved = max((_loglik(brighter, one) for one in sigmas.tolist()), key=lambda fit: fit.nats).sigma
    error = _error(law, best.sigma) * max(_misfit(law, best), 1.0)
    sigma = of_all(best.sigma, best.left)
    error = hypot(error, moved - best.sigma) * sigma / best.sigma
    return Spread(sigma, error, best.nats - equal, best.left if best.share else 1.0)


def _count(pixels: Sequence[_Pixels]) -> float:
    return sum(float(own.seen.counts.sum()) for own in pixels)


def _own(pixels: Sequence[_Pixels], sigma: float) -> float:
    """Return how far the mean of these pixels is from that of all sensors, of it, by chance."""
    return sqrt(float(np.expm1(sigma**2)) / _count(pixels))


@dataclass(frozen=True)
class _Fit:
    """A law's log-likelihood, shares of stray and hot pixels, and what of the mean others have."""

    sigma: float
    nats: float
    stray: int
    share: float
    left: float = 1.0


def _likeliest(pixels: Sequence[_Pixels], known: float, sigmas: Array) -> _Fit:
    """Return the likeliest law without hot pixels.

    The mean of its pixels is that of all, as far as that is `known`, and as their own is by chance.
    """
    fits = []
    for sigma in sigmas.tolist():
        for chance in _CHANCES:
            left = max(1 + chance * hypot(known, _own(pixels, sigma)), _LEFT[-1])
            law = [own.of_mean(own.equal.mean * left) for own in pixels]
            fit = _loglik(law, sigma)
            fits.append(replace(fit, left=left, nats=fit.nats - chance**2 / 2))
    return max(fits, key=lambda fit: fit.nats)


def _beside_hot(pixels: Sequence[_Pixels], sigmas: Array, lefts: Array) -> _Fit:
    """Return the likeliest law where hot pixels have a part of the mean, at odds of 20.

    Both at once: a tail of the law is no hot pixels, whose mean another spread would have.
    """
    fits = []
    for left in lefts.tolist():
        law = [own.beside_hot(left) for own in pixels]
        fits += [replace(_loglik(law, sigma), left=left) for sigma in sigmas.tolist()]
    best = max(fits, key=lambda fit: fit.nats)
    return replace(best, nats=best.nats - _TOLD)


def _equal(pixels: Sequence[_Pixels], lefts: Array) -> float:
    """Return the log-likelihood of equal dark currents, beside noise that may be wider."""
    laws = [[one.beside_hot(left) for one in pixels] for left in lefts.tolist()]
    return max(_loglik(law, 0.0, wider).nats for law in laws for wider in _WIDER)


def _misfit(pixels: Sequence[_Pixels], fit: _Fit) -> float:
    """Return the factor by which pixels scatter about their law more than chance does (Birge)."""
    chi2, bins = 0.0, 0
    for own in pixels:
        edges = _edges(own.seen.values)
        near = (own.seen.values > edges[0]) & (own.seen.values < edges[-1])
        places = np.searchsorted(edges, own.seen.values[near]) - 1
        seen = np.bincount(places, own.seen.counts[near], edges.size - 1)
        between = (edges[:-1, np.newaxis] + np.diff(edges)[:, np.newaxis] * _PARTS).ravel()
        law = own.mixed(between, fit).reshape(-1, _PARTS.size).mean(1)
        expected = law * np.diff(edges) * own.seen.counts.sum()
        groups = np.floor(np.cumsum(expected) / _MANY)
        starts = np.flatnonzero(np.diff(groups, prepend=-1.0) > 0)
        one, other = (np.add.reduceat(values, starts) for values in (seen, expected))
        full = other >= _MANY / 2
        chi2 += float(((one - other)[full] ** 2 / other[full]).sum())
        bins += int(full.sum())
    return sqrt(chi2 / (bins - _NUMBERS)) if bins > 2 * _NUMBERS else 1.0


def _edges(values: Array) -> Array:
    """Return the edges of bins into which values were rounded, see `Binned`, up to the farthest."""
    steps = round(FAR / BIN)
    linear = BIN * (np.arange(-steps, steps) + 0.5)
    farthest = np.log(np.maximum(np.abs([values.min(), values.max()]), FAR) / FAR) / BIN
    low, high = (
        FAR * np.exp(BIN * (np.arange(round(count) + 1) + 0.5)) for count in farthest.tolist()
    )
    return np.concatenate([-low[::-1], linear, high])


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


def _loglik(pixels: Sequence[_Pixels], sigma: float, width: float = 1.0) -> _Fit:
    """Return how likely a law is, with the likeliest shares of pixels that are none of it.

    Hot pixels have what the others leave of the mean, and no pixel is one where that is nothing.
    """
    shares = _HOT if pixels[0].bright > 0 else np.zeros(1)
    total = np.zeros((_STRAY.size, shares.size))
    for own in pixels:
        values = own.seen.values
        body = replace(own.equal, log_sigma=sigma).density(values, width)
        body = np.maximum(body, _LEAST)
        for i, stray in enumerate(_STRAY):
            most = (1 - stray) * body + stray * own.stray
            for j, share in enumerate(shares.tolist()):
                both = most + share * (own.all_hot[j] - most) if share else most
                total[i, j] += np.log(both) @ own.seen.counts
    stray, share = np.unravel_index(int(total.argmax()), total.shape)
    return _Fit(sigma, float(total.max()), int(stray), float(shares[share]))
