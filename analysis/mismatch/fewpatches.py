"""A field of gains that few patches make: dust throws shadows, which are like no random field."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.candidates.fields import gains
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.measures.fixed_pattern import Smooth

Array = NDArray[np.float64]
_MOST_PIXELS = 512  # a side: of a larger sensor its middle
_PIXELS, _ROUNDS, _NEAR = 4096, 8, 0.3  # of a surface; of the median deviation: no nearer one
_DRAWS, _CLEAR = 64, 4.0  # fields of chance; standard deviations among them
_MOST = 0.5  # of the field's variance, that few patches may make
_FEW_DRAWS, _SURELY = 8, 0.65  # fields by which it may be clear that it is more than that
_NORMAL = 0.75  # of it, from which no drawn field need be asked: theirs is near 1
_SIDE = 0.15865525393145707  # of normal values lie beyond one standard deviation, on a side


def of_few_patches(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by few patches that make most of it; None: not.

    A normal field, seen through the filter that lifts it best out of white noise (Wiener, 1949), is
    normal: what as many lie beyond as beyond one standard deviation tells its variance, on either
    side of the middle. Patches make one side; on the other lies the rest of the sensor. Where that
    tells half or less of what is no white noise, far less than fields of this spectrum ever do,
    most of the sensor has no such gain.
    """
    image = gains_for(state, effect)
    if image is None or not isinstance(effect, SmoothPrnu):
        return None
    why = "few patches make most of it, as no field of gains is made"
    return unlike_drawn(image, effect, _of_nearer_side, why)


def gains_for(state: State, effect: Effect) -> Array | None:
    """Return the map of gains that tells a field, %; None: no field, or no map of it."""
    image = gains(state.clues()) if isinstance(effect, SmoothPrnu) else None
    return None if image is None else _middle(image)


def unlike_drawn(
    image: Array, effect: SmoothPrnu, share_of: Callable[[Array, Array], float], why: str
) -> Denial | None:
    """Return how a field is denied by a map that shows less of it than drawn fields do; None: not.

    Parameters
    ----------
    image
        The map of gains, %: (row, column).
    effect
        The field.
    share_of
        Gives the share of a field that a map shows, from the map and the field's power by
        frequency.
    why
        In words.
    """
    field = effect.sigma_percent**2 * spectrum(image.shape, effect.length_pixels)
    share = share_of(image, field)
    if share > _NORMAL:
        return None
    rng = np.random.default_rng(0)
    chance: list[float] = []
    root = np.sqrt(field + white_of(image))
    for draw in range(_DRAWS):
        if draw == _FEW_DRAWS and share > _SURELY * float(np.mean(chance)):
            return None  # the others would not make fields show that much more
        drawn = fft.rfft2(rng.standard_normal(image.shape)) * root
        seen = parts(fft.irfft2(drawn, image.shape), 1.0).pixels  # as the map's are
        chance.append(share_of(seen, field))
    expected = float(np.mean(chance))
    if share > _MOST * expected or expected - share < _CLEAR * float(np.std(chance)):
        return None
    return Denial(max(share / expected, 0.0), why)


def _of_nearer_side(image: Array, field: Array) -> float:
    """Return the share of the field's variance that the nearer side of the filtered image tells.

    White noise, of which the filter leaves a known part, is not counted. A smooth surface that
    patches pull with them was taken off the image: it is put back.
    """
    white = white_of(image)
    gain = field / (field + white)
    lifted = fft.irfft2(fft.rfft2(image) * gain, image.shape)
    noise = white * float((fft.irfft2(gain, image.shape) ** 2).sum())
    level = lifted - _surface(lifted)
    low, middle, high = np.quantile(level, [_SIDE, 0.5, 1 - _SIDE])
    square = float(lifted.var()) - noise
    nearer = float(min(middle - low, high - middle)) ** 2 - noise
    return nearer / square if square > 0 else 1.0


def _surface(image: Array) -> Array:
    """Return the smooth surface of least absolute deviations: (row, column).

    By reweighted least squares (Schlossmacher, 1973), from as many pixels as it needs.
    """
    smooth = Smooth.of(*image.shape)
    degree = np.arange(smooth.degree + 1)
    y, x = np.nonzero(degree[:, np.newaxis] + degree <= smooth.degree)
    step = max(int((image.size / _PIXELS) ** 0.5), 1)
    few = image[::step, ::step]
    bases = smooth.along_rows[::step, y], smooth.along_columns[::step, x]
    design = (bases[0][:, np.newaxis] * bases[1]).reshape(few.size, y.size)
    weight: Array = np.ones(few.size, np.float64)
    found: Array = np.zeros(y.size)
    for _ in range(_ROUNDS):
        weighted = design * weight[:, np.newaxis]
        found = np.asarray(np.linalg.solve(weighted.T @ design, weighted.T @ few.ravel()))
        apart = np.abs(few.ravel() - design @ found)
        weight = 1 / np.maximum(apart, max(_NEAR * float(np.median(apart)), 1e-12))
    coefficients = np.zeros((degree.size, degree.size))
    coefficients[y, x] = found
    return smooth.surface(coefficients)


def white_of(image: Array) -> float:
    """Return the variance of what neighbours do not share."""
    steps = np.diff(image, axis=1)
    return max(float((steps**2).mean()) / 2, 1e-12)


def spectrum(shape: tuple[int, ...], length: float) -> Array:
    """Return the power of a field of variance 1 at each frequency: (row, half the columns)."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    covariance = np.exp(-np.hypot(y[:, np.newaxis], x) / length)
    return np.asarray(np.maximum(fft.rfft2(covariance).real, 0.0))


def _middle(image: Array) -> Array:
    """Return the middle of a large image."""
    first = [max(size - _MOST_PIXELS, 0) // 2 for size in image.shape]
    rows, columns = (slice(own, own + _MOST_PIXELS) for own in first)
    return image[rows, columns]
