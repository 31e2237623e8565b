"""A field of gains that few patches make: dust throws shadows, which are like no random field."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.candidates.fields import gains
from analysis.mismatch.contradicted import Denial
from analysis.mismatch.state import State
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu
from dsis.measures.spikes import variance_of_quartiles

Array = NDArray[np.float64]
_MOST_PIXELS = 512  # a side: of a larger sensor its middle
_DRAWS, _CLEAR = 64, 4.0  # fields of chance; standard deviations among them
_MOST = 0.5  # of the field's variance, that few patches may make
_NORMAL = 0.75  # of it, from which no drawn field need be asked: theirs is near 1


def of_few_patches(state: State, effect: Effect) -> Denial | None:
    """Return how a field of gains is denied by few patches that make most of it; None: not.

    A normal field, seen through the filter that lifts it best out of white noise (Wiener, 1949), is
    normal: its quartiles tell its variance. Where they tell half of it or less, far fewer than
    fields of this spectrum ever do, most of the sensor has no such gain.
    """
    image = gains(state.clues()) if isinstance(effect, SmoothPrnu) else None
    if image is None or not isinstance(effect, SmoothPrnu):
        return None
    image = _middle(image)
    field = effect.sigma_percent**2 * _spectrum(image.shape, effect.length_pixels)
    share = _of_quartiles(image, field)
    if share > _NORMAL:
        return None
    rng, chance = np.random.default_rng(0), []
    root = np.sqrt(field + _white(image))
    for _ in range(_DRAWS):
        drawn = fft.rfft2(rng.standard_normal(image.shape)) * root
        chance.append(_of_quartiles(fft.irfft2(drawn, image.shape), field))
    expected = float(np.mean(chance))
    if share > _MOST * expected or expected - share < _CLEAR * float(np.std(chance)):
        return None
    return Denial(share / expected, "few patches make most of it, as no field of gains is made")


def _of_quartiles(image: Array, field: Array) -> float:
    """Return the share of the filtered image's variance that its quartiles tell."""
    lifted = fft.irfft2(fft.rfft2(image) * (field / (field + _white(image))), image.shape)
    low, high = np.percentile(lifted, [25, 75])
    square = float(lifted.var())
    return variance_of_quartiles(float(low), float(high)) / square if square > 0 else 1.0


def _white(image: Array) -> float:
    """Return the variance of what neighbours do not share."""
    steps = np.diff(image, axis=1)
    return max(float((steps**2).mean()) / 2, 1e-12)


def _spectrum(shape: tuple[int, ...], length: float) -> Array:
    """Return the power of a field of variance 1 at each frequency: (row, half the columns)."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    covariance = np.exp(-np.hypot(y[:, np.newaxis], x) / length)
    return np.asarray(np.maximum(fft.rfft2(covariance).real, 0.0))


def _middle(image: Array) -> Array:
    """Return the middle of a large image."""
    first = [max(size - _MOST_PIXELS, 0) // 2 for size in image.shape]
    rows, columns = (slice(own, own + _MOST_PIXELS) for own in first)
    return image[rows, columns]
