"""Gains that neighbours share: the spectrum of the gain's map tells how much, and how far."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

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
_SHORTEST = 0.7  # pixels of the plane: neighbours of less have nothing in common
_LENGTHS = 16
_LONGEST = 1 / 6  # of a plane's shorter side: what is longer is a smooth surface
_BINS = 32
_LOWEST, _HIGHEST = 4.0, 0.75  # cycles a plane, a pixel: smooth surfaces have what is lower
_OF_LINES = 1.5  # cycles a plane along an axis, that means of lines have with the window
_FAR_OUT = 5.0  # standard deviations of pixels, beyond which they count as so far out
_ROUNDS = 6
_LEAST = 1e-9  # of the largest power
_CLEAR = 9.0  # of chi-squared


@dataclass(frozen=True)
class _Spectrum:
    """Mean power of maps in bins of spatial frequency, %^2.

    Attributes
    ----------
    power
        As recorded.
    known
        Of the fields that the camera has already.
    count
        Frequencies in each bin.
    """

    power: Array
    known: Array
    count: Array


def _smooth_prnu(clues: Clues) -> Sequence[Proposal]:
    """Start from the field that, beside white gains, makes the gain's spectrum most likely."""
    seen = _spectrum(clues)
    if seen is None:
        return []
    shape, step = _plane(clues)
    lengths = np.geomspace(_SHORTEST, max(min(shape) * _LONGEST, 2 * _SHORTEST), _LENGTHS) * step
    fits = [(*_fitted(seen, _unit(shape, step, own)), own) for own in lengths.tolist()]
    cost, variance, length = min(fits)
    if variance <= 0 or _fitted(seen, np.zeros_like(seen.power))[0] - cost < _CLEAR:
        return []
    return proposals(
        "smooth_prnu",
        ["sigma_percent", "length_pixels"],
        sigma_percent=min(variance**0.5, 90.0),
        length_pixels=length,
    )


def _fitted(seen: _Spectrum, unit: Array) -> tuple[float, float]:
    """Return what white gains and a field leave open, chi-squared, and the field's variance.

    By Whittle's likelihood: weighted least squares, their weights from the round before.
    """
    expected, variance = np.maximum(seen.power, _LEAST * seen.power.max()), 0.0
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


def _plane(clues: Clues) -> tuple[tuple[int, int], int]:
    """Return the shape of a channel's plane, and its pitch in pixels of the sensor."""
    channel = clues.layout.channels[0]
    return clues.shape(channel), 1 if channel == "MONO" else 2


def _spectrum(clues: Clues) -> _Spectrum | None:
    """Return the spectrum of the gain, of all channels by their weights; None: there is no map."""
    shape, step = _plane(clues)
    made, weights = [], []
    for channel, (image, noise) in clues.image("gain").items():
        own = parts(image, noise)
        if image.shape != shape or not own.square > 0:
            continue
        limit = _FAR_OUT * own.square**0.5
        unit = (noise * 100 / clues.scale("gain", channel)) ** 2
        made.append(_binned(_power(np.clip(own.pixels, -limit, limit)), shape) * unit)
        weights.append(1 / (own.square * unit) ** 2)
    if not made:
        return None
    known = np.zeros_like(made[0])
    for effect in clues.camera.effect:
        if isinstance(effect, SmoothPrnu):
            known += effect.sigma_percent**2 * _unit(shape, step, effect.length_pixels)
    count = np.bincount(_bins(shape).ravel(), minlength=_BINS + 1)[:_BINS]
    return _Spectrum(np.average(made, axis=0, weights=weights), known, count.astype(np.float64))


def _power(image: Array) -> Array:
    """Return the periodogram of an image, white noise at its variance: (row, half the columns)."""
    window = np.outer(np.hanning(image.shape[0]), np.hanning(image.shape[1]))
    return np.asarray(np.abs(fft.rfft2(image * window)) ** 2 / (window**2).sum())


@lru_cache(maxsize=64)
def _unit(shape: tuple[int, int], step: int, length: float) -> Array:
    """Return the power, in each bin, of a field of variance 1, seen at every `step` pixels."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    covariance = np.exp(-step * np.hypot(y[:, None], x) / length)
    return _binned(np.maximum(fft.rfft2(covariance).real, 0.0), shape)


def _binned(power: Array, shape: tuple[int, int]) -> Array:
    """Return the mean power in each bin of a plane's spectrum, 0 where there is none."""
    bins = _bins(shape).ravel()
    sums, count = np.bincount(bins, power.ravel(), _BINS + 1), np.bincount(bins, None, _BINS + 1)
    return np.asarray((sums / np.maximum(count, 1))[:_BINS])


@lru_cache(maxsize=8)
def _bins(shape: tuple[int, int]) -> NDArray[np.int64]:
    """Return the bin of each frequency of a plane; `_BINS`: of none, for lines or surfaces."""
    down, across = np.abs(fft.fftfreq(shape[0]))[:, None], fft.rfftfreq(shape[1])
    f, low = np.hypot(down, across), _LOWEST / min(shape)
    at = _BINS * np.log(np.maximum(f, low) / low) / np.log(_HIGHEST / low)
    none = (f < low) | (down * shape[0] < _OF_LINES) | (across * shape[1] < _OF_LINES)
    return np.where(none, _BINS, np.clip(at.astype(np.int64), 0, _BINS - 1))


def _shorter(layout: Layout, effect: Effect) -> bool:
    """Return whether a field is far shorter than the sensor: longer ones are uneven light."""
    size = min(layout.rows, layout.columns)
    return not isinstance(effect, SmoothPrnu) or effect.length_pixels < 2 * _LONGEST * size


CANDIDATES = (
    Candidate(
        "smooth_prnu",
        ("fixed_patch_variance", "fixed_correlation_0_1", "fixed_correlation_1_0"),
        _smooth_prnu,
        sane=_shorter,
    ),
)
