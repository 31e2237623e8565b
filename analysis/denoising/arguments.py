"""The two arguments of a denoiser, checked in one place."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.denoising.spectrum import NoiseSpectrum

Noise = ArrayLike | NoiseSpectrum


def checked(
    image: NDArray[np.float32], noise: Noise, smallest: int
) -> tuple[NDArray[np.float32], NoiseSpectrum]:
    """Return the image as float32 and the noise as a spectrum.

    Raises
    ------
    ValueError
        Where the image is not (row, column) or (row, column, 3), is smaller than `smallest` along
        an axis or holds a number that is not finite, or where the noise does not fit it.
    """
    given = np.asarray(image, np.float32)
    if given.ndim not in (2, 3) or (given.ndim == 3 and given.shape[2] != 3):
        message = f"image must be (row, column) or (row, column, 3): {given.shape}"
        raise ValueError(message)
    if min(given.shape[:2]) < smallest:
        message = f"image must be at least {smallest} x {smallest}: {given.shape}"
        raise ValueError(message)
    if not np.isfinite(given).all():
        raise ValueError("image must be finite")
    spectrum = noise if isinstance(noise, NoiseSpectrum) else NoiseSpectrum.white(noise)
    if given.ndim == 2 and spectrum.covariance.shape[2] != 1:
        raise ValueError("noise of three channels does not fit a grey image")
    return given, spectrum
