"""Dark current that parts of a sensor do not have: something else grows with exposure time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import logsumexp

from analysis.mismatch.bank.robust import drawn_in, typical_square
from analysis.mismatch.bank.seams import beyond_smooth
from analysis.mismatch.candidates.patterns import EXTENTS, PLACES, glowing
from analysis.mismatch.contradicted import Denial, rival
from analysis.mismatch.leftopen import warm_left
from analysis.mismatch.rank import TOLD_APART
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.amp_glow import AmpGlow
from dsis.effects.dark_current import DarkCurrent
from dsis.effects.hot_pixels import HotPixels

Array = NDArray[np.float64]
_AROUND, _FAR_OUT = 3, 5.0  # pixels; standard deviations
_PARTS = 4  # along each side
_LEAST_SHARE = 0.5  # of a dark current, that every part of the sensor must show
_SURE = 3.0  # standard errors: the least of sixteen
_SHARES = tuple(np.linspace(0, 0.95, 20).tolist())  # of what grows, that a glow may have
_POWERS = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
_LENGTHS = (0.005, 0.01, 0.02, *EXTENTS)
_FINER = tuple(np.geomspace(0.05, 1.0, 20).tolist())
_FALLS = (0.0, 1.0, 2.0)  # exponentially, and by powers
_TWICE = 2
_SIDE = 64  # of a map, that tells a smooth surface
_TAIL = 1 / 3  # of a glow's height, that it may have where it is least
_SEEN = 3.5  # of a surface: chance has that among the map's few numbers in 1 % of recordings
_SMOOTH = "fixed_smooth"


def uneven(state: State, effect: Effect | None) -> Denial | None:
    """Return how an even dark current is denied by where levels grow with time; None: it is not.

    The map of what grows with time has a mean of zero: how much of the mean that grows is a smooth
    surface's - a glow's, say - it does not tell. Where such a surface is left unexplained, the part
    of the sensor that grows least must grow for sure, by half of a dark current; else all may be
    the surface's, and a glow of the same mean, that somewhere has less than half of it, must be
    denied beside those that have a share of it: at the far end of one that fades slowly all may
    grow by a third. Where no part is certain by itself, a glow of the same mean must be denied by
    the map, at odds of 20. Beside a glow or hot pixels that are named nothing is said, for the map
    has their mean too - but that a glow may fall off more slowly than exponentially: as 1 / r it
    has a third of its height left at twice its length, all over the sensor. In any case most pixels
    must grow: see `_of_few`.
    """
    if not isinstance(effect, DarkCurrent) or not effect.dn_per_s:
        return None
    return _of_parts(state, effect) or _of_few(state, effect)


def _of_parts(state: State, effect: DarkCurrent) -> Denial | None:
    """Return how a dark current is denied by parts of the sensor or a glow; None: it is not."""
    if any(isinstance(other, AmpGlow | HotPixels) for other in state.camera.effect):
        return _tail(state, effect)
    left = state.null.departures(state.vector)
    if not any(
        abs(z) > _SEEN and key.scope == "time" and key.statistic.startswith(_SMOOTH)
        for key, z in zip(state.null.keys, left, strict=True)
    ):
        return _glowing(state, effect)
    shares, errors = [], []
    for (channel, name), (image, noise) in state.setting.seen.images.items():
        if name != "time":
            continue
        growth = effect.dn_per_s * state.setting.layout.regressors(channel).scales["time"]
        means = _parts(image)
        shares.append(1 + means / growth)
        errors.append(noise / growth * (means.size / image.size) ** 0.5)
    if not shares:
        return None
    share = float(np.mean(shares, axis=0).min())
    error = float(np.sqrt(np.mean(np.square(errors)) / len(errors)))
    if share - _SURE * error > 0 and share + _SURE * error >= _LEAST_SHARE:
        return _glowing(state, effect, _SHARES, _FINER, _FALLS)
    least = f"{max(share, 0):.0%} +- {error:.0%}"
    return Denial(share, f"a part of the sensor grows with exposure time by {least} of it")


def _of_few(state: State, effect: DarkCurrent) -> Denial | None:
    """Return how a dark current is denied by pixels most of which do not grow; None: they do.

    Beside their mean, which levels tell, the median of all pixels' growth is that of the dark
    current alone, whatever few of them add: the mean is, too, that of the hot ones. Where dark
    currents differ log-normally, the median is a share of the mean. A glow, which
    most pixels have some of, says nothing of it. Where pixels that stand out with exposure time are
    left unexplained, which may make all of the mean, most must grow for certain.
    """
    if any(isinstance(other, AmpGlow) for other in state.camera.effect):
        return None
    hot = (e for e in state.camera.effect if isinstance(e, HotPixels))
    others = sum(e.pixel_fraction * e.mean_dn_per_s for e in hot)
    shares, errors = [], []
    for (channel, name), (image, noise) in state.setting.seen.images.items():
        if name != "time":
            continue
        unit = effect.dn_per_s * state.setting.layout.regressors(channel).scales["time"]
        middle = float(np.median(image - image.mean()))
        wide = max(noise, typical_square(image - image.mean()) ** 0.5)
        shares.append(1 + others / effect.dn_per_s + middle / unit)
        errors.append((np.pi / 2 / image.size) ** 0.5 * wide / unit)
    if not shares:
        return None
    median = float(np.exp(-(effect.log_sigma**2) / 2))
    share = float(np.mean(shares)) / median
    error = float(np.sqrt(np.mean(np.square(errors)) / len(errors))) / median
    sure = not warm_left(state) or share - _SURE * error > 0
    if sure and share + _SURE * error >= _LEAST_SHARE:
        return None
    least = f"{max(share, 0):.0%} +- {error:.0%}"
    return Denial(share, f"most pixels grow with exposure time by {least} of it")


def _tail(state: State, effect: DarkCurrent) -> Denial | None:
    """Return how a dark current is denied by the glow that is named: its tail may be as much.

    Unless the map tells, at odds of 20: of a glow that falls off by some power, and has the mean of
    both, it shows less than of the exponential one of whatever height.
    """
    glows = [e for e in state.camera.effect if isinstance(e, AmpGlow)]
    glow = max(glows, key=lambda own: own.dn_per_s, default=None)
    if glow is None or effect.dn_per_s >= _TAIL * glow.dn_per_s:
        return None
    behind = _behind_powers(state, effect, glow)
    if behind < -TOLD_APART:
        return None
    why = "a glow that falls off more slowly has as much all over the sensor"
    return rival(behind, why)


def _behind_powers(state: State, effect: DarkCurrent, glow: AmpGlow) -> float:
    """Return by how much a glow that falls off by a power shows more in the map, nats.

    Its mean is that of both; the exponential glow beside the dark current has any height.
    """
    layout = state.setting.layout
    images = {c: own for (c, name), own in state.setting.seen.images.items() if name == "time"}
    maps = {
        # Where a glow is brightest, which is far out, it tells most; not so single pixels.
        c: _Map.of(image, noise, min(len(images), 2)).of_smoother(image)
        for c, (image, noise) in images.items()
    }

    def products(extent: float, power: float) -> tuple[float, float]:
        square = along = 0.0
        for channel, own in maps.items():
            plain = glowing(own.image.shape, glow.place, glow.extent)
            mean = effect.dn_per_s + glow.dn_per_s * float(plain.mean())
            shape = glowing(own.image.shape, glow.place, extent, power)
            growth = mean * layout.regressors(channel).scales["time"]
            of_shape, of_both = own.products(growth * (shape / shape.mean() - 1))
            square, along = square + of_shape, along + of_both
        return square, along

    if not maps:
        return np.inf
    square, along = products(glow.extent, 0.0)
    own = along**2 / square / 2 if square > 0 else 0.0
    slower = (products(extent, power) for extent, power in product(_LENGTHS, _POWERS))
    return max(along - square / 2 for square, along in slower) - own


def _glowing(
    state: State,
    effect: DarkCurrent,
    shares: Sequence[float] = (0.0,),
    extents: Sequence[float] = EXTENTS,
    falls: Sequence[float] = (0.0,),
) -> Denial | None:
    """Return how a dark current is denied by a glow of the same mean; None: the map denies one.

    Of a glow of shape g and mean m the map is m (g / mean(g) - 1) and noise: m is known as well as
    pixels tell, a normal variate, over which the likelihood ratio is integrated in closed form; so
    it is over all places and extents that a glow is looked for in, each as likely. Noise is that of
    the map's pixels where they scatter more than frames alone make them, and of its rows and
    columns where these do: noise of whole lines is not averaged along them. Where all frames will
    be asked, only a glow that is likelier denies. It is held against glows that have `shares` of
    the mean beside a dark current that has the rest, each as likely: 0, none.
    """
    layout, ratios = state.setting.layout, []
    beside: list[float] = []
    images = {c: own for (c, name), own in state.setting.seen.images.items() if name == "time"}
    alike = min(len(images), 2)  # channels that share a line, and its noise
    maps = {c: _Map.of(*own, alike).coarser() for c, own in images.items()}
    if not maps:
        return None
    pixels = sum(
        own.image.size * (effect.dn_per_s * layout.regressors(c).scales["time"]) ** 2 / own.mean_dn2
        for c, own in maps.items()
    )
    for place, extent, fall in product(PLACES, extents, falls):
        square = along = least = 0.0
        for channel, own in maps.items():
            glow = glowing(own.image.shape, place, extent, fall)
            growth = effect.dn_per_s * layout.regressors(channel).scales["time"]
            of_shape, of_both = own.products(growth * (glow / glow.mean() - 1))
            square += of_shape
            along += of_both
            least = max(least, float(glow.min() / glow.mean()))
        # What grows everywhere by half of its mean is as good as a dark current beside a surface.
        if least < _LEAST_SHARE or len(shares) == 1:
            ratios.append(_ratio(square, along, pixels))
        beside += [_ratio(own**2 * square, own * along, pixels) for own in shares]
    behind = float(logsumexp(ratios) - logsumexp(beside)) + log(len(beside) / len(ratios))
    if state.setting.asked_again and behind <= 0:
        return None
    return rival(behind, "of the sensor what grows with exposure time may as well be a glow")


@dataclass(frozen=True)
class _Map:
    """A map of one channel, about its mean, and the variances of its noise.

    Attributes
    ----------
    image
        What is far out is drawn in: (row, column).
    pixel_dn2, row_dn2, column_dn2
        Of single pixels; of waves that are constant along rows, and along columns.
    """

    image: Array
    pixel_dn2: float
    row_dn2: float
    column_dn2: float

    @classmethod
    def of(cls, image: Array, noise: float, alike: int) -> "_Map":
        """Return a map of known noise of frames; `alike` channels share the noise of a line."""
        drawn, lines = drawn_in(image), []
        pixel = max(noise**2, typical_square(image - image.mean()))
        for axis in (1, 0):
            seen = typical_square(beyond_smooth(drawn.mean(axis))) * image.shape[axis]
            lines.append(pixel + alike * max(seen - pixel, 0.0))
        return cls(drawn, pixel, *lines)

    def coarser(self) -> "_Map":
        """Return a map of means over squares of pixels, as fine as a smooth surface needs it."""
        step = min(self.image.shape) // _SIDE
        if step < _TWICE:
            return self
        rows, columns = (size // step for size in self.image.shape)
        squares = self.image[: rows * step, : columns * step].reshape(rows, step, columns, step)
        variances = (self.pixel_dn2, self.row_dn2, self.column_dn2)
        return _Map(squares.mean((1, 3)), *(own / step**2 for own in variances))

    def of_smoother(self, image: Array) -> "_Map":
        """Return this with an image without pixels that stand out of those around them."""
        around = median_filter(image, _AROUND, mode="nearest")
        far = np.abs(image - around) > _FAR_OUT * self.pixel_dn2**0.5
        plain = np.where(far, around, image)
        return replace(self, image=np.asarray(plain - plain.mean()))

    @property
    def mean_dn2(self) -> float:
        """The variance of the mean, times the pixels."""
        return self.row_dn2 + self.column_dn2 - self.pixel_dn2

    def products(self, shape: Array) -> tuple[float, float]:
        """Return the square of a shape, and its product with the map, in units of noise."""
        square = along = 0.0
        parts = (_lines_apart(shape), _lines_apart(self.image))
        variances = (self.row_dn2, self.column_dn2, self.pixel_dn2)
        for own, seen, variance in zip(*parts, variances, strict=True):
            square += float((own**2).sum()) / variance
            along += float((own * seen).sum()) / variance
        return square, along


def _lines_apart(image: Array) -> tuple[Array, Array, Array]:
    """Return what rows of an image have in common, what columns have, and the rest: its size."""
    apart = image - image.mean()
    rows, columns = apart.mean(1, keepdims=True), apart.mean(0, keepdims=True)
    rest = apart - rows - columns
    none = np.zeros_like(apart)
    return none + rows, none + columns, rest


def _ratio(square: float, along: float, precision: float) -> float:
    """Return the log of the mean of exp(a s - a^2 q / 2) over a normal a, of mean 1.

    Of q `square` and s `along`; `precision` is the inverse variance of a.
    """
    grown = 1 + square / precision
    return (along - square / 2 + along**2 / precision / 2) / grown - log(grown) / 2


def _parts(image: Array) -> Array:
    """Return the means of sixteen parts of an image, (part,)."""
    rows = np.array_split(image, _PARTS, axis=0)
    return np.array([part.mean() for row in rows for part in np.array_split(row, _PARTS, axis=1)])
