"""Hot pixels measured: the likeliest law of single pixels of the map that grows with exposure time.

Of a sensor with hot pixels a map has normal noise, to which an exponential variate of mean m is
added in a share f of the pixels. Its density there is that of Grushka (1972),
1 / m exp(s^2 / (2 m^2) - x / m) Phi(x / s - s / m). What few simulated sensors say of a law whose
brightest pixels count most is chance; this is a closed form.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import log_ndtr, ndtri

from analysis.currentlaw import BIN, Binned, Body, exponential

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Bounds = Sequence[tuple[float, float]]
_AROUND = 5  # pixels: a glow is as bright beside a pixel
# A pixel less the median of n around it, itself among them: of normal ones the median's variance is
# pi / (2 n + pi - 2), its covariance with each 1 / n.
_PIXELS = _AROUND**2
_BESIDE = sqrt(1 + pi / (2 * _PIXELS + pi - 2) - 2 / _PIXELS)
_TABLE, _LEAST = 4000, 1e-300
_ALIKE = Body()
_SHARES = (1e-6, 0.4)
_MEANS = (0.3, 1e5)  # in noises
_WIDTHS = 8.0  # standard errors of the width of noise
_COUNTS, _POINTS = (40, 40, 9), (21, 21, 9)  # of a first grid and of finer ones
_PASSES = 3
_WITHIN = 4.0  # of log-likelihood below the best: the next grid
_INTERVAL = 1.92  # of log-likelihood: half of chi-squared at 95 %
_NORMAL = 1.96


@dataclass(frozen=True)
class HotLaw:
    """A law of the pixels of a map.

    Attributes
    ----------
    gain
        Of log-likelihood beside normal noise alone, nats.
    share, mean
        Of hot pixels; of what is added to one, in the map's unit.
    share_error, mean_error
        To the farther end of the 95 % interval of the profile likelihood, over 1.96.
    """

    gain: float
    share: float
    mean: float
    share_error: float
    mean_error: float


@dataclass(frozen=True)
class _Pixels:
    """Values of a channel's pixels in noises, the noise, and the law of those that are not hot."""

    seen: Binned
    noise: float
    body: Body

    def loglik(self, shares: Array, means: Array, widths: Array) -> Array:
        """Return the log-likelihood of laws: (share, mean, width); a share of 0 is noise alone.

        Values count from their median, which hot pixels move: the others are centred below it. Of
        hot pixels themselves, whose law is wider, that is left out.
        """
        width = widths[:, np.newaxis]
        unit = self.seen.values / width
        rate = width * self.noise / means[:, np.newaxis, np.newaxis]
        tail = exponential(unit, rate) - np.log(width)
        above = np.exp(rate**2 / 2 + log_ndtr(-rate))  # of hot pixels, beyond a half
        others = self._others(widths)
        found = []
        for share in shares:
            core = others(share * above)
            if share > 0:
                core = np.logaddexp(core + np.log1p(-share), tail + np.log(share))
            found.append(core @ self.seen.counts)
        return np.stack(found)

    def _others(self, widths: Array) -> Callable[[Array], Array]:
        """Return the log-density of the others, (mean, width, value).

        It is asked for what share of all the median is moved by: (mean, width, 1).
        """
        values, width = self.seen.values, widths[:, np.newaxis]
        if not self.body:
            scale = np.log(2 * np.pi) / 2 + np.log(width)
            return lambda moved: -((values / width + moved * np.sqrt(2 * np.pi)) ** 2) / 2 - scale
        ends = float(values.min()) - 1, float(values.max()) + 1
        fine = np.unique(np.concatenate([values, np.linspace(*ends, _TABLE)]))
        logs = np.log(np.maximum([self.body.density(fine, one) for one in widths.tolist()], _LEAST))
        middle = np.exp([np.interp(0.0, fine, own) for own in logs])[:, np.newaxis]

        def others(moved: Array) -> Array:
            at = values + moved / middle
            some = [np.interp(at[:, i], fine, own) for i, own in enumerate(logs)]
            return np.stack(some, 1)

        return others


def hot_laws(
    images: Mapping[str, tuple[Array, float]],
    left_out: Mapping[str, Mask],
    current: Body = _ALIKE,
) -> list[HotLaw]:
    """Return the likeliest law of hot pixels in maps, and those at the ends of its interval.

    Few pixels that are hot, and many that are warm, are nearly as likely by what stands out.

    Parameters
    ----------
    images
        Of each channel a map (row, column) with its noise.
    left_out
        Pixels of it that say nothing.
    current
        Dark currents of the others, in the maps' unit.
    """
    pixels = [
        _Pixels(
            Binned.of((image - around(image))[~left_out[name]], noise),
            noise,
            replace(current, mean=current.mean / noise),
        )
        for name, (image, noise) in images.items()
        if not left_out[name].all()
    ]
    if not pixels or not _robust(pixels) > 0:
        return []
    noise = float(np.mean([own.noise for own in pixels]))
    error = 1 / sqrt(2 * sum(float(own.seen.counts.sum()) for own in pixels))
    # Noise is known: what is narrower is not the map. What else differs makes it wider.
    known, most = log(_BESIDE), max(log(_robust(pixels)), log(_BESIDE))
    width = (known - error, most + _WIDTHS * error)
    bounds: Bounds = (
        (log(_SHARES[0]), log(_SHARES[1])),
        (log(_MEANS[0] * noise), log(_MEANS[1] * noise)),
        width,
    )
    for number in range(1 + _PASSES):
        points = _POINTS if number else _COUNTS
        axes = [np.linspace(*ends, n) for ends, n in zip(bounds, points, strict=True)]
        found = np.sum([own.loglik(*map(np.exp, axes)) for own in pixels], axis=0)
        best = float(found.max())
        bounds = [_ends(axis, found, i, best - _WITHIN) for i, axis in enumerate(axes)]
    widths = np.exp(np.linspace(*width, 41))
    plain = np.sum([own.loglik(np.zeros(1), np.ones(1), widths) for own in pixels], axis=0)
    intervals = [np.exp(_ends(axes[i], found, i, best - _INTERVAL)) for i in (0, 1)]
    profile = found.max((1, 2))
    within = np.flatnonzero(profile >= best - _INTERVAL)
    laws = []
    for at in dict.fromkeys((int(profile.argmax()), int(within[0]), int(within[-1]))):
        which = int(found[at].max(1).argmax())
        values = (float(np.exp(axes[0][at])), float(np.exp(axes[1][which])))
        errors = (
            float(np.abs(ends - value).max()) / _NORMAL
            for ends, value in zip(intervals, values, strict=True)
        )
        laws.append(HotLaw(float(profile[at] - plain.max()), *values, *errors))
    return laws


def around(image: Array, size: int = _AROUND) -> Array:
    """Return the median of the pixels around each; beyond the edges a map goes on as steeply.

    `size` is that of the square, pixels: odd.
    """
    reach = size // 2
    padded = np.pad(image, reach, mode="reflect", reflect_type="odd")
    return np.asarray(median_filter(padded, size)[reach:-reach, reach:-reach])


def _robust(pixels: Sequence[_Pixels]) -> float:
    """Return the width of most pixels, in noises: from how many lie within one.

    0 where that says none: all pixels lie within one, or none does.
    """
    within = sum(
        float(own.seen.counts[np.abs(own.seen.values) < 1 + BIN / 2].sum()) for own in pixels
    )
    share = within / sum(float(own.seen.counts.sum()) for own in pixels)
    return float((1 + BIN / 2) / ndtri((1 + share) / 2)) if 0 < share < 1 else 0.0


def _ends(axis: Array, found: Array, which: int, least: float) -> tuple[float, float]:
    """Return between which values of a parameter the profile likelihood is above `least`."""
    others = tuple(i for i in range(found.ndim) if i != which)
    within = np.flatnonzero(found.max(others) >= least)
    first, last = max(int(within[0]) - 1, 0), min(int(within[-1]) + 1, axis.size - 1)
    return float(axis[first]), float(axis[last])
