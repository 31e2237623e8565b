"""Light of any smooth shape: what flats show that no fall to the corners, tilt or ring describes.

Behind a lens light falls off by tens of per cent, off the centre and of each colour in its own way.
Averaged over a megapixel that is known to parts in a million, and no shape of few numbers has it:
beside what such a shape leaves nothing else is seen. So the light itself is measured, by smooth
polynomials whose coefficients end.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.mismatch.candidates import Proposal
from analysis.mismatch.candidates.patterns import SURFACES, light_over, made_of_light, surfaces
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout
from analysis.mismatch.named import Named
from dsis.effects.shading import Shading

Array = NDArray[np.float64]
_DEGREE = 14  # of a polynomial, in both directions together
_HIGHEST = 12  # that is kept; what is higher tells whether its coefficients end
_LEAST = 10.0  # standard errors of a coefficient in the mean, beyond shapes of few numbers
_ENDS = 0.03  # of the coefficients of low degrees, that those of high ones have
_BY_CHANCE = 2.0  # standard deviations of their mean square
_NOISE = 3.0  # and of those of one degree, three of which in a row are none but noise
_CLIPPED = 5.0  # standard deviations of a pixel
_STEPS = ((_DEGREE + 1, 0), (0, _DEGREE + 1))  # where coefficients of steps are: down, across
_SURE = 3.0  # standard errors of a step
_DARK = 0.05  # of the mean light, below which a camera's own shading leaves nothing to tell
_KIND = "shading"
_OWN = 3  # degree from which light has a shape of its own
_NORMAL = 1.4826  # standard deviations of a median absolute deviation
_FALL, _TILTS = "falloff_percent", ("tilt_down_percent", "tilt_right_percent")


def measured_light(clues: Clues, *, beside: bool = False) -> Named | None:
    """Return the light as the flats show it; None: none, or shapes of few numbers have it.

    The gain's map of each colour, over what the camera's own effects make of even light, is a sum
    of products of Legendre polynomials beside steps of halves, by least squares; of as many as rise
    beyond noise. It is light where many coefficients with both directions in them do, which lines
    and halves have not, and where these end, which those of gains that neighbours share do not. And
    where it is `beside` uneven light of the user's camera, which is not as much, or not there.
    """
    images = clues.image("gain")
    if set(images) != set(clues.layout.sites):
        return None
    fitted = [_fitted(clues, channel, *images[channel]) for channel in clues.layout.sites]
    if any(own is None for own in fitted):
        return None
    planes = [own for own in fitted if own is not None]
    strength = np.mean([own.strength for own in planes])
    light = strength >= _LEAST**2 and not any(own.open_ended for own in planes)
    if beside:
        light = light or np.mean([own.surfaces for own in planes]) >= _LEAST**2
    if not light:
        return None
    return _named(planes, clues.layout.grid.sensor_shape)


@dataclass(frozen=True)
class _Plane:
    """A colour's light, 1 in the mean of the sensor: coefficients (down, across), their errors.

    Attributes
    ----------
    strength
        Mean square of coefficients in their errors, beyond shapes of few numbers.
    surfaces
        Of those of the first two degrees.
    open_ended
        Whether coefficients of high degree are as large as those of low ones, nearly.
    """

    found: Array
    errors: Array
    strength: float
    surfaces: float
    open_ended: bool

    @property
    def degree(self) -> int:
        """Up to which coefficients are more than noise."""
        order = _orders(self.found.shape)
        noise = 0
        for degree in range(_OWN, _HIGHEST + 1):
            own = order == degree
            square = float(np.mean((self.found[own] / self.errors[own]) ** 2))
            chance = 1 + _NOISE * (2 / np.count_nonzero(own)) ** 0.5
            noise = 0 if square > chance else noise + 1
            if noise == _OWN:
                return degree - noise
        return _HIGHEST - noise

    def at(self, down: float, across: float) -> float:
        """Return the light at a place, in halves of the sides from the centre."""
        kept = np.where(_orders(self.found.shape) <= self.degree, self.found, 0.0)
        return float(np.polynomial.legendre.legval2d(down, across, kept))


def _fitted(clues: Clues, channel: str, image: Array, noise: float) -> _Plane | None:
    """Return the light of a colour; None: its map is too small."""
    if min(image.shape) <= 2 * _DEGREE:
        return None
    scale = clues.scale("gain", channel)
    had = made_of_light(clues, channel).reshape(image.shape)
    if had.min() < _DARK * had.mean():
        return None
    light = light_over(clues, channel, image, had)
    fit = _Fit.of(clues.layout, channel)
    found, rest = _most_of(fit, light)
    sd = max(float(rest.std()), noise / scale)
    if (np.abs(found[_STEPS]) < _SURE * sd * fit.errors[_STEPS]).all():  # none: odd degrees rule
        fit = _Fit.of(clues.layout, channel, steps=False)
        found, rest = _most_of(fit, light)
    errors = sd * fit.errors
    # What lines have in common, of which terms along one axis alone are means.
    for axis, at in ((1, np.s_[:, 0]), (0, np.s_[0, :])):
        lines = float(rest.mean(axis).std()) * rest.shape[axis] ** 0.5
        errors[at] *= max(lines / sd, 1.0)
    # 1 in the mean of the sensor: sites of two colours have not the same places in it.
    found, errors = found[:-1, :-1] / found[0, 0], errors[:-1, :-1] / found[0, 0]
    order = _orders(found.shape)
    both = np.minimum(*np.indices(found.shape)) > 0
    beyond = found - _of_few(fit, image.shape, found, np.where(both, errors, np.inf))
    low, high = both & (order >= _OWN) & (order <= 2 * _OWN), both & (order > _HIGHEST)
    high &= order <= _DEGREE
    noise_square = float(np.mean(errors[high] ** 2))
    chance = 1 + _BY_CHANCE * (2 / np.count_nonzero(high)) ** 0.5
    above = float(np.mean(found[high] ** 2)) - chance * noise_square
    ends = above <= _ENDS**2 * float(np.mean(beyond[low] ** 2))
    squares = (found / errors) ** 2
    first = (order > 0) & (order < _OWN)
    strength = float(np.mean((beyond[low] / errors[low]) ** 2))
    return _Plane(found, errors, strength, float(np.mean(squares[first])), not ends)


def _most_of(fit: "_Fit", light: Array) -> tuple[Array, Array]:
    """Return the coefficients of most pixels, and what they leave: far-out pixels count less."""
    found = fit(light)
    rest = light - fit.made(found)
    limit = _CLIPPED * _NORMAL * float(np.median(np.abs(rest)))
    found = found + fit(np.clip(rest, -limit, limit))
    return found, np.clip(light - fit.made(found), -limit, limit)


@dataclass(frozen=True)
class _Fit:
    """Least squares of a plane by products of polynomials, and by steps of halves.

    Attributes
    ----------
    down, across
        Polynomials along columns and along rows, and last a step: (line, function).
    pairs
        Which of both are multiplied: (pair, 2).
    inverse
        Of the normal equations (pair, pair).
    """

    down: Array
    across: Array
    pairs: NDArray[np.intp]
    inverse: Array

    @classmethod
    def of(cls, layout: Layout, channel: str, *, steps: bool = True) -> "_Fit":
        """Return the fit of a channel, at the places its pixels have on the sensor."""
        step = 1 + (len(layout.sites) > 1)
        down, across = (
            _along(np.arange(first, seen, step), size)
            for first, seen, size in zip(
                layout.sites[channel],
                (layout.rows, layout.columns),
                layout.grid.sensor_shape,
                strict=True,
            )
        )
        order = _orders((_DEGREE + 1, _DEGREE + 1))
        pairs = np.argwhere(order <= _DEGREE)
        pairs = np.vstack([pairs, np.transpose(_STEPS)]) if steps else pairs
        k, m = pairs.T
        square = (down.T @ down)[np.ix_(k, k)] * (across.T @ across)[np.ix_(m, m)]
        return cls(down, across, pairs, np.asarray(np.linalg.inv(square), np.float64))

    def __call__(self, plane: Array) -> Array:
        """Return the coefficients of a plane, 0 of what is no pair."""
        k, m = self.pairs.T
        moments = (self.down.T @ plane @ self.across)[k, m]
        found = np.zeros((_DEGREE + 2, _DEGREE + 2))
        found[k, m] = self.inverse @ moments
        return found

    def made(self, found: Array) -> Array:
        """Return the plane of coefficients."""
        return np.asarray(self.down @ found @ self.across.T)

    @property
    def errors(self) -> Array:
        """Standard errors of coefficients, in noise of 1; 1 of what is no pair."""
        k, m = self.pairs.T
        found = np.ones((_DEGREE + 2, _DEGREE + 2))
        found[k, m] = np.sqrt(np.diag(self.inverse))
        return found


def _along(places: NDArray[np.integer], size: int) -> Array:
    """Return polynomials at places of a sensor of some size, and a step in its middle."""
    at = (places - (size - 1) / 2) / (size / 2)
    return np.column_stack([np.polynomial.legendre.legvander(at, _DEGREE), np.sign(at)])


def _of_few(fit: _Fit, shape: tuple[int, ...], found: Array, errors: Array) -> Array:
    """Return what of coefficients, those without errors apart, shapes of few numbers have."""
    some = surfaces(shape, sorted(SURFACES)).reshape(-1, *shape)
    made = np.stack([fit(one)[:-1, :-1] for one in (np.ones(shape), *some)])
    design = (made / errors).reshape(len(made), -1).T
    values = np.linalg.lstsq(design, (found / errors).ravel(), rcond=None)[0]
    return np.asarray(np.tensordot(values, made, 1))


def _orders(shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the degree of each coefficient, in both directions together."""
    return np.asarray(np.add(*np.indices(shape)))


def _named(planes: Sequence[_Plane], shape: tuple[int, int]) -> Named:
    """Return shading with the light of all colours."""
    degree = max(own.degree for own in planes)
    size = max(degree, 2) + 1
    kept = np.where(_orders((size, size)) <= degree, 1.0, 0.0)
    centre = [own.at(0.0, 0.0) for own in planes]
    corners = [np.mean([own.at(y, x) for y in (-1.0, 1.0) for x in (-1.0, 1.0)]) for own in planes]
    falls = 1 - np.array(corners) / np.array(centre)
    fall = float(np.clip(falls.mean(), 0, 1))
    tilts = [float(np.mean([own.found[at] for own in planes])) for at in ((1, 0), (0, 1))]
    known = {_FALL: 100 * fall} | dict(zip(_TILTS, (100 * t for t in tilts), strict=True))
    plain = _plain(fall, tilts, shape, size)
    fields = tuple(
        tuple(tuple(row) for row in (100 * kept * (own.found[:size, :size] - plain)).tolist())
        for own in planes
    )
    effect = Shading.model_validate({"kind": _KIND, **known, "field": fields})
    spread = float(np.std(falls)) / max(len(planes) - 1, 1) ** 0.5
    noise = float(np.mean([np.linalg.norm(own.errors[:size, :size] * kept) for own in planes]))
    errors = {_FALL: 100 * float(np.hypot(spread, noise))} if falls.mean() > 0 else {}
    for name, at in zip(_TILTS, ((1, 0), (0, 1)), strict=True):
        own = [one.found[at] for one in planes]
        scatter = float(np.std(own)) / max(len(own) - 1, 1) ** 0.5
        errors[name] = 100 * float(np.hypot(scatter, np.mean([one.errors[at] for one in planes])))
    gain = float(sum(own.strength for own in planes)) / 2
    return Named(_KIND, Proposal(effect, (), errors=errors), errors, gain, ())


def _plain(fall: float, tilts: Sequence[float], shape: tuple[int, int], size: int) -> Array:
    """Return the coefficients of a fall to the corners and tilts: squares are 1/3 + 2/3 L_2."""
    found = np.zeros((size, size))
    found[0, 0] = 1 - fall / 3
    down = shape[0] ** 2 / (shape[0] ** 2 + shape[1] ** 2)
    found[2, 0], found[0, 2] = -fall * 2 / 3 * down, -fall * 2 / 3 * (1 - down)
    found[1, 0], found[0, 1] = tilts
    return found
