"""The fields that Table 2 denoises: two kinds of noise, at stage 2 or 3, demosaicked or not."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from analysis.denoising import NoiseSpectrum
from analysis.paper.scene import Scene
from dsis.cfa import mosaic
from dsis.color import white_balanced
from dsis.covariance import (
    LagCovariance,
    linearised_noise,
    measured_covariance,
    predicted_covariance,
)
from dsis.demosaic import METHODS, demosaic
from dsis.draw import Draw
from dsis.grid import PixelGrid

Image: TypeAlias = NDArray[np.float32]

KINDS = (("awgn", 3), ("sd", 3), ("sd", 2))
LAGS = 4  # of the spectra that adapted denoisers get
ALL_METHODS = ("none", *METHODS)


@dataclass(frozen=True)
class Cell:
    """One field to be denoised.

    Attributes
    ----------
    noise, stage, method
        "awgn" or "sd"; 2 (white-balanced, linear, DN) or 3 (display, 0..1); demosaicking or "none".
    noisy, still
        The field with and without noise, float32 (row, column, 3), nothing clipped.
    """

    noise: str
    stage: int
    method: str
    noisy: Image
    still: Image

    @property
    def sigma(self) -> NDArray[np.float64]:
        """Root mean square of the noise by channel: what a plain denoiser is told."""
        square = np.square(self.noisy - self.still, dtype=np.float64)
        return np.asarray(np.sqrt(square.mean(axis=(0, 1))))


def cells(city: Scene, frame: int, methods: Sequence[str] = ALL_METHODS) -> Iterator[Cell]:
    """Yield the fields of a frame, three for each method; stages 2 and 3 carry the same noise."""
    clean = city.clean(frame)
    reference = city.rendering.reference(clean)
    white, noisy = city.white(reference, frame), city.noisy(clean, frame)
    for method in methods:
        seen = [city_display(city, x, method) for x in (white, reference)]
        yield Cell("awgn", 3, method, *seen)
        balanced = [city_balanced(city, x, method) for x in (noisy, clean)]
        yield Cell("sd", 3, method, *(city.display_of_balanced(x) for x in balanced))
        yield Cell("sd", 2, method, *balanced)


def city_display(city: Scene, display: Image, method: str) -> Image:
    """Return a display frame, mosaicked and demosaicked unless `method` is "none"."""
    return display if method == "none" else city.white_demosaicked(display, method)


def city_balanced(city: Scene, raw: Image, method: str) -> Image:
    """Return raw planes after white balance, and after demosaicking unless `method` is "none"."""
    if method == "none":
        return white_balanced(raw, city.camera.white_balance)
    full_scale = city.full_scale
    return demosaic(city.balanced_mosaic(raw), city.camera.cfa, method, full_scale=full_scale)


def white_spectrum(city: Scene, cell: Cell, sigma: float) -> NoiseSpectrum:
    """Return equation (5) for noise of one variance on the mosaic that a cell comes from.

    `sigma` is in the unit of the cell; with DLMMSE and Lu-Tan the Jacobian is taken at the noisy
    mosaic, whose samples the methods leave as they are.
    """
    cfa = city.camera.cfa
    variance = np.full(cell.still.shape[:2], sigma**2, np.float32)
    if cell.method == "none":
        return NoiseSpectrum.white(sigma)
    if cell.method == "bilinear":
        return _spectrum(predicted_covariance(variance, cfa, lags=LAGS))
    grid = PixelGrid(cell.still.shape[0], cell.still.shape[1], cfa)
    probe = np.float32(sigma) * Draw(city.rendering.seed, ("table 2",)).normal("probe", grid)
    full_scale = 1.0 if cell.stage == 3 else city.full_scale

    def full(sampled: Image) -> Image:
        return demosaic(sampled, cfa, cell.method, full_scale=full_scale)

    noise = linearised_noise(full, mosaic(cell.noisy, cfa), probe)
    return _spectrum(measured_covariance(noise, lags=LAGS))


def display_spectrum(city: Scene, clean: Image, method: str) -> NoiseSpectrum:
    """Return the mean spectrum of camera noise at stage 3: the whole pipeline linearised.

    The covariance is that of equation (5) seen through the derivative of the colour transform,
    averaged over the frame.
    """
    variance = city.camera.segments.variance_dn2(clean) + np.float32(1 / 12)
    grid = PixelGrid(clean.shape[0], clean.shape[1])
    field = Draw(city.rendering.seed, ("table 2",)).normal("display probe", grid)

    def shown(raw: Image) -> Image:
        return city.display_of_balanced(city_balanced(city, raw, method))

    noise = linearised_noise(shown, clean, np.sqrt(variance) * field)
    return _spectrum(measured_covariance(noise, lags=LAGS))


def _spectrum(moments: LagCovariance) -> NoiseSpectrum:
    return NoiseSpectrum.of_autocovariance(moments.stationary())
