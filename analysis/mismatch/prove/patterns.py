"""Fixed patterns: what training frames tell about the sensor under a camera model.

The mean maps of all exposures are seen in the cosine transform, in classes of spatial frequency:
along lines, across them, smooth, and the rest. A virtual sensor says how large the pattern is in
each class and how it is shared by the exposures; the pattern of the recorded sensor is then the
Wiener estimate from its training frames, in every exposure from all of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.prove.hot import Hot
from dsis.measures.median import median

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_FAR = 6.0  # robust standard deviations from which a pixel is an outlier of a map
_LEAST_OUTLIERS = 4
_SURE = 3.0  # standard deviations of chance
_AXIS_BANDS = 24
_MANY = 64  # waves in a class from which the base model's own noise cancels
_LOW = 3  # bands of low frequency that are told apart off the axes


@dataclass(frozen=True)
class Halves:
    """Mean maps of a virtual sensor from earlier and from later frames: (exposure, row, column).

    Attributes
    ----------
    early, late
        Means over frames, mean over the site taken off.
    frames
        In each half: (exposure,).
    """

    early: Array
    late: Array
    frames: Array


@dataclass(frozen=True)
class Pattern:
    """The fixed pattern of one site of the colour filter array under a model.

    Attributes
    ----------
    gains
        Wiener gain of each class of frequencies: (class, exposure, exposure).
    outliers
        Gain of pixels far from all others, (exposure, exposure); None: the model has none.
    hot
        Pixels that are hot, where they are too few for that; None: the model has none.
    """

    gains: Array
    outliers: Array | None
    hot: Hot | None = None

    def estimate(self, maps: Array) -> tuple[Array, Mask]:
        """Return the pattern that training maps (exposure, row, column) tell, and outliers."""
        shape = maps.shape[1:]
        far = far_pixels(maps) if self.outliers is not None else np.zeros(shape, np.bool_)
        plain = np.where(far, 0.0, maps)
        waves = fft.dctn(plain, axes=(1, 2), norm="ortho").reshape(maps.shape[0], -1)
        made = np.zeros_like(waves)
        for members, gain in zip(classes((shape[0], shape[1])), self.gains, strict=True):
            if gain.any():
                made[:, members] = gain @ waves[:, members]
        pattern = fft.idctn(made.reshape(maps.shape), axes=(1, 2), norm="ortho")
        if self.outliers is not None and far.any():
            pattern[:, far] += self.outliers @ (maps[:, far] - pattern[:, far])
        if self.hot is not None:
            pattern += self.hot.estimate(maps - pattern)
        return np.asarray(pattern, np.float64), far


def far_pixels(maps: Array) -> Mask:
    """Return which pixels lie far from all others in any map."""
    far = np.zeros(maps.shape[1:], np.bool_)
    for image in maps:
        departure = np.abs(image - median(image))
        spread = 1.4826 * median(departure)
        if spread > 0:
            far |= departure > _FAR * spread
    return far


def pattern_of(model: Halves, base: Halves, variance_dn2: Array, trained: Array) -> Pattern:
    """Return the pattern of a model from its virtual sensor and that of the base model.

    Parameters
    ----------
    model, base
        Mean maps of the virtual sensors, of the same draws.
    variance_dn2
        Of the base model's pixels: (exposure,).
    trained
        Training frames of the recording: (exposure,).
    """
    first, second = far_pixels(model.early), far_pixels(model.late)
    far, odd = first & second, None
    others = (far_pixels(base.early) & far_pixels(base.late)).sum()
    # Pixels that were hit in both halves by chance are no pattern.
    chance = float(first.sum()) * float(second.sum()) / first.size
    if far.sum() - others - chance >= max(_LEAST_OUTLIERS, _SURE * chance**0.5):
        shared = _cross(model.early[:, far], model.late[:, far])
        odd = _gain(_positive(shared, variance_dn2, 0.0), variance_dn2, trained)
    early, late = (np.where(far, 0.0, half) for half in (model.early, model.late))
    model = Halves(early, late, model.frames)
    waves = [_waves(halves) for halves in (model, base)]
    gains = []
    for members in classes((model.early.shape[1], model.early.shape[2])):
        (a, b), (c, d) = ((e[:, members], f[:, members]) for e, f in waves)
        shared = _cross(a, b) - _cross(c, d)
        change = ((a - b) ** 2).mean(1) - ((c - d) ** 2).mean(1)
        noise = np.maximum(variance_dn2 + model.frames / 2 * change, 0.1 * variance_dn2)
        # What is new in each frame leaves a shared part by chance: demand more than that.
        own = noise / variance_dn2 - (members.size >= _MANY)
        floor = (
            2 * max(float(np.max(own / model.frames)), 0.0) * np.sqrt(len(trained) / members.size)
        )
        gains.append(_gain(_positive(shared, variance_dn2, floor), noise, trained))
    return Pattern(np.array(gains), odd)


def _waves(halves: Halves) -> tuple[Array, Array]:
    early, late = (
        fft.dctn(maps, axes=(1, 2), norm="ortho").reshape(maps.shape[0], -1)
        for maps in (halves.early, halves.late)
    )
    return early, late


def _cross(early: Array, late: Array) -> Array:
    """Return the symmetric covariance between exposures, free of temporal noise."""
    product = early @ late.T / early.shape[1]
    covariance: Array = (product + product.T) / 2
    return covariance


def _positive(covariance: Array, variance_dn2: Array, floor: float) -> Array:
    """Return the nearest covariance, without eigenvalues below `floor` x noise."""
    scale = np.sqrt(np.outer(variance_dn2, variance_dn2))
    values, vectors = np.linalg.eigh(covariance / scale)
    near: Array = (vectors * np.where(values > floor, values, 0)) @ vectors.T * scale
    return near


def _gain(covariance: Array, noise_dn2: Array, trained: Array) -> Array:
    """Return C (C + N)^-1, without what no training frame tells."""
    seen = trained > 0
    gain = np.zeros_like(covariance)
    if covariance.any() and seen.any():
        total = covariance[np.ix_(seen, seen)] + np.diag(noise_dn2[seen] / trained[seen])
        gain[:, seen] = np.linalg.solve(total, covariance[seen]).T
    return gain


@lru_cache(maxsize=8)
def classes(shape: tuple[int, int]) -> tuple[NDArray[np.intp], ...]:
    """Return the classes of cosine waves of a map, as flat indices; the mean is in none."""
    down, across = (_bands(size) for size in shape)
    y, x = np.broadcast_arrays(down[:, np.newaxis], across[np.newaxis])
    label = np.full(shape, 10_000)
    label[:, 0], label[0, :] = down, _AXIS_BANDS * 2 + across
    low = (y > 0) & (x > 0) & (y <= _LOW) & (x <= _LOW)
    label[low] = (_AXIS_BANDS * 4 + y * (_LOW + 1) + x)[low]
    flat = label.reshape(-1)
    flat[0] = -1
    found: Sequence[int] = [int(v) for v in np.unique(flat) if v >= 0]
    return tuple(np.nonzero(flat == v)[0] for v in found)


def _bands(size: int) -> NDArray[np.intp]:
    """Return the band of each frequency: 1, 2, 3-4, 5-8 ..., and the same from the highest down."""
    from_low = np.ceil(np.log2(np.maximum(np.arange(size), 1))).astype(np.intp) + 1
    from_high = np.ceil(np.log2(np.maximum(size - np.arange(size), 1))).astype(np.intp) + 1
    bands = np.where(np.arange(size) < size / 2, from_low, 2 * _AXIS_BANDS - 1 - from_high)
    bands[0] = 0
    return bands
