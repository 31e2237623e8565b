"""Gains that neighbours share: the spectrum of the gain's map tells how much, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from analysis.mismatch.bank.parts import parts
from analysis.mismatch.candidates.candidate import Candidate, Proposal, proposals
from analysis.mismatch.clues import Clues
from analysis.mismatch.layout import Layout
from dsis.effects import Effect
from dsis.effects.smooth_prnu import SmoothPrnu

Array = NDArray[np.float64]
_SHORTEST = 0.7  # pixels: neighbours of less have nothing in common
_LENGTHS = 16
_AS_LIKELY, _APART = 3.84, 2.5  # of chi-squared, 95 %; times as long, to be worth a trial
_LONGEST, _UNEVEN = 1 / 4, 1 / 3  # of the shorter side: what is longer is a smooth surface
_BINS = 32
_LOWEST, _HIGHEST = 4.0, 0.75  # cycles a plane, a pixel: smooth surfaces have what is lower
_OF_LINES = 1.5  # cycles a plane along an axis, that means of lines have with the window
_FAR_OUT = 5.0  # standard deviations of pixels, beyond which they count as so far out
_ALIKE = 3.78  # frequencies that the window makes one: Hann's, in two dimensions
_ROUNDS = 6
_LEAST = 1e-9  # of the largest power


@dataclass(frozen=True)
class _Spectrum:
    """Mean power of the gain's map in bins of spatial frequency, %^2.

    Attributes
    ----------
    power
        As recorded.
    known
        Of the fields that the camera has already.
    count
        Independent frequencies in each bin.
    """

    power: Array
    known: Array
    count: Array


def _smooth_prnu(clues: Clues) -> Sequence[Proposal]:
    """Start from fields that, beside white gains, make the gain's spectrum most likely.

    The long waves of a weak field are few: its spectrum then tells no length, all numbers do.
    """
    found: list[Proposal] = []
    lengths: list[float] = []
    near = sorted(fields(clues))
    for own in near:
        apart = all(max(own.length / one, one / own.length) > _APART for one in lengths)
        likely = own.variance > 0 and own.left < near[0].left + _AS_LIKELY
        if likely and apart and own.length > _SHORTEST:
            lengths.append(own.length)
            found += proposals(
                "smooth_prnu",
                ["sigma_percent", "length_pixels"],
                sigma_percent=min(own.variance**0.5, 90.0),
                length_pixels=own.length,
            )
    return found


class Field(NamedTuple):
    """What a field leaves open of the gain's spectrum, chi-squared; its variance, %^2; pixels."""

    left: float
    variance: float
    length: float


def fields(clues: Clues) -> list[Field]:
    """Return the field of each length that fits the gain's spectrum best; none without a map."""
    image = gains(clues)
    if image is None:
        return []
    seen = _spectrum(clues, image)
    if not seen.count.any():  # few rows or columns: they hold no frequency of a field
        return []
    longest = max(min(image.shape) * _LONGEST, 2 * _SHORTEST)
    lengths = np.geomspace(_SHORTEST, longest, _LENGTHS).tolist()
    return [Field(*_fitted(seen, _unit(image.shape, own)), own) for own in lengths]


def _fitted(seen: _Spectrum, unit: Array) -> tuple[float, float]:
    """Return what white gains and a field leave open, chi-squared, and the field's variance.

    By Whittle's likelihood: weighted least squares, their weights from the round before.
    """
    expected, variance = np.full_like(seen.power, np.average(seen.power, weights=seen.count)), 0.0
    for _ in range(_ROUNDS):
        weight = seen.count / expected**2
        white = float(weight @ (seen.power - seen.known) / weight.sum())
        rest = unit - float(weight @ unit / weight.sum())
        square = float((weight * rest) @ rest)
        variance = float((weight * rest) @ (seen.power - seen.known)) / square if square else 0.0
        variance = max(variance, 0.0)
        white -= variance * float(weight @ unit / weight.sum())
        made = seen.known + max(white, 0.0) + variance * unit
        expected = np.maximum(made, _LEAST * seen.power.max())
    return float(2 * (seen.count * (np.log(expected) + seen.power / expected)).sum()), variance


def gains(clues: Clues) -> Array | None:
    """Return what lines and surfaces leave of the gain, %, of all channels; None: no map of it.

    What all colours share shows best in the whole mosaic.
    """
    sites, images = clues.layout.sites, clues.image("gain")
    if set(images) != set(sites):
        return None
    whole, step = np.zeros((clues.layout.rows, clues.layout.columns)), 1 + (len(sites) > 1)
    for channel, (image, noise) in images.items():
        own = parts(image, noise)
        limit = _FAR_OUT * own.square**0.5
        y, x = sites[channel]
        unit = noise * 100 / clues.scale("gain", channel)
        whole[y::step, x::step] = np.clip(own.pixels, -limit, limit) * unit
    return whole


def _spectrum(clues: Clues, image: Array) -> _Spectrum:
    """Return the spectrum of a map of gains beside that of the camera's own fields."""
    known = np.zeros(_BINS)
    for effect in clues.camera.effect:
        if isinstance(effect, SmoothPrnu):
            known += effect.sigma_percent**2 * _unit(image.shape, effect.length_pixels)
    count = np.bincount(_bins(image.shape).ravel(), minlength=_BINS + 1)[:_BINS]
    return _Spectrum(_binned(_power(image), image.shape), known, count / _ALIKE)


def _power(image: Array) -> Array:
    """Return the periodogram of an image, white noise at its variance: (row, half the columns)."""
    window = np.outer(np.hanning(image.shape[0]), np.hanning(image.shape[1]))
    return np.asarray(np.abs(fft.rfft2(image * window)) ** 2 / (window**2).sum())


@lru_cache(maxsize=64)
def _unit(shape: tuple[int, ...], length: float) -> Array:
    """Return the power, in each bin, of a field of variance 1."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    covariance = np.exp(-np.hypot(y[:, None], x) / length)
    return _binned(np.maximum(fft.rfft2(covariance).real, 0.0), shape)


def _binned(power: Array, shape: tuple[int, ...]) -> Array:
    """Return the mean power in each bin of a map's spectrum, 0 where there is none."""
    bins = _bins(shape).ravel()
    sums, count = np.bincount(bins, power.ravel(), _BINS + 1), np.bincount(bins, None, _BINS + 1)
    return np.asarray((sums / np.maximum(count, 1))[:_BINS])


@lru_cache(maxsize=8)
def _bins(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Return the bin of each frequency of a map; `_BINS`: of none, for lines or surfaces."""
    down, across = np.abs(fft.fftfreq(shape[0]))[:, None], fft.rfftfreq(shape[1])
    f, low = np.hypot(down, across), _LOWEST / min(shape)
    at = _BINS * np.log(np.maximum(f, low) / low) / np.log(_HIGHEST / low)
    none = (f < low) | (down * shape[0] < _OF_LINES) | (across * shape[1] < _OF_LINES)
    return np.where(none, _BINS, np.clip(at.astype(np.int64), 0, _BINS - 1))


def _shorter(layout: Layout, effect: Effect) -> bool:
    """Return whether a field is far shorter than the sensor, and longer than a pixel.

    Longer ones are uneven light, of shorter ones neighbours share nothing: they are white.
    """
    size = min(layout.rows, layout.columns)
    if not isinstance(effect, SmoothPrnu):
        return True
    return _SHORTEST < effect.length_pixels < _UNEVEN * size


CANDIDATES = (
    Candidate(
        "smooth_prnu",
        ("fixed_patch_variance", "fixed_correlation_0_1", "fixed_correlation_1_0"),
        _smooth_prnu,
        # A field has long waves too, so have many other surfaces; pixels vary with each gain.
        hints=("fixed_smooth_variance", "fixed_pixel_variance"),
        sane=_shorter,
    ),
)
